//! What a body's shape is, as far as anything is worked out of it: a hash that any change of it changes.

use super::kept::{BitsHasher, KeptOfShape};
use super::model::{Body, Home};

/// Of larger bodies nothing is kept: what is worked out of them takes more memory than they do.
const MOST_TAXELS: usize = 20_000;
const MOST_VERTICES: usize = 500_000;

impl Body {
    /// What is kept of the body's shape as it is now: its links, surfaces and taxels, but not its fields. A body that was changed begins
    /// anew.
    #[must_use]
    pub fn kept_of_shape(&self) -> KeptOfShape<'_> {
        let vertices: usize = self.surfaces.iter().map(|surface| surface.positions.len()).sum();
        let small = self.taxels.len() <= MOST_TAXELS && vertices <= MOST_VERTICES;
        KeptOfShape { kept: small.then(|| (&self.kept, fingerprint(self))) }
    }
}

/// A hash of the links, surfaces and taxels of `body`.
fn fingerprint(body: &Body) -> u64 {
    let mut hash = BitsHasher::default();
    hash.number(body.links.len());
    for link in &body.links {
        hash.number(link.parent.unwrap_or(usize::MAX));
        hash.affine(&link.body_from_link);
    }
    hash.number(body.taxels.len());
    for taxel in &body.taxels {
        hash.number(taxel.id);
        hash.number(taxel.link);
        hash.number(taxel.modality.code());
        hash.vector(taxel.position_in_link);
        hash.vector(taxel.normal_in_link);
        hash.vector(taxel.tangent_in_link.unwrap_or_default());
        hash.numbers([taxel.area]);
    }
    hash.number(body.surfaces.len());
    for surface in &body.surfaces {
        hash.number(surface.positions.len());
        surface.positions.iter().for_each(|&position| hash.vector(position));
        hash.number(surface.triangles.len());
        surface.triangles.iter().flatten().for_each(|&vertex| hash.number(vertex));
        match &surface.home {
            Home::Rigid { link, link_from_mesh } => {
                hash.number(*link);
                hash.affine(link_from_mesh);
            }
            Home::Skinned { joints, heaviest, at_rest } => {
                hash.number(u64::MAX);
                hash.number(joints.len());
                for (link, link_from_mesh) in joints {
                    hash.number(*link);
                    hash.affine(link_from_mesh);
                }
                heaviest.iter().for_each(|&joint| hash.number(joint));
                at_rest.iter().for_each(|&place| hash.vector(place));
            }
        }
    }
    hash.finish()
}

#[cfg(test)]
mod tests {
    use somatic_bodies as bundled;

    use super::*;

    #[test]
    fn a_value_is_made_once_for_a_shape_and_again_for_another() {
        let mut body = Body::from_bytes("hand", bundled::HAND).unwrap();
        let mut made = 0;
        let mut get = |body: &Body, key: u64| {
            *body.kept_of_shape().get(key, || {
                made += 1;
                made
            })
        };
        assert_eq!([get(&body, 7), get(&body, 7), get(&body, 8), get(&body.clone(), 7)], [1, 1, 2, 1]);
        body.fields.clear();
        assert_eq!(get(&body, 7), 1);
        // The last bit of anything that a shape has.
        let changes: [fn(&mut Body); 6] = [
            |body| body.taxels[3].position_in_link.x = body.taxels[3].position_in_link.x.next_up(),
            |body| body.taxels[3].area = body.taxels[3].area.next_up(),
            |body| body.links[1].body_from_link.translation.y = body.links[1].body_from_link.translation.y.next_up(),
            |body| body.surfaces[0].positions[5].z = body.surfaces[0].positions[5].z.next_up(),
            |body| body.surfaces[0].triangles[2].swap(0, 1),
            |body| body.taxels.truncate(body.taxels.len() - 1),
        ];
        for (wanted, change) in (3..).zip(changes) {
            change(&mut body);
            assert_eq!([get(&body, 7), get(&body, 7)], [wanted; 2]);
        }
    }
}
