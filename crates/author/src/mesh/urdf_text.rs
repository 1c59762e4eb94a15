//! A body's skin as a URDF, with `<sensor><tactile>` as `--urdf-skin` reads it.

use std::fmt::Write as _;
use std::path::Path;

use glam::{DAffine3, DVec3};

use crate::body::{Body, Modality, Taxel};
use crate::plain;

/// The depth of a taxel's box, which says nothing, m.
const BOX_DEPTH_M: f64 = 0.001;
/// The one data vector, in which a taxel's index is its id.
const CHANNEL: &str = "skin";

/// `body` as a URDF: its links with fixed joints as they stand at rest, and its taxels for pressure as `<taxel>`s of one
/// `<sensor>` a link; a taxel's index is its id, its z axis the normal, and its box has its area. Also gives what is left out.
#[must_use]
pub fn urdf_of_skin(body: &Body) -> (String, Vec<String>) {
    let name = Path::new(&body.name).file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    let mut text = format!("<?xml version=\"1.0\"?>\n<robot name=\"{}\">\n", escaped(&name));
    let base = base(body);
    for link in base.iter().chain(body.links.iter().map(|link| &link.name)) {
        let _ = writeln!(text, "  <link name=\"{}\"/>", escaped(link));
    }
    for link in &body.links {
        let (parent, parent_from_link) = match (link.parent, &base) {
            (Some(parent), _) => {
                let parent = &body.links[parent];
                (&parent.name, parent.body_from_link.inverse() * link.body_from_link)
            }
            (None, Some(base)) => (base, link.world_from_link()),
            (None, None) => continue,
        };
        let (child, parent) = (escaped(&link.name), escaped(parent));
        let _ = writeln!(
            text,
            "  <joint name=\"{child} joint\" type=\"fixed\">\n    <parent link=\"{parent}\"/>\n    <child link=\"{child}\"/>\n    \
             <origin {}/>\n  </joint>",
            pose(&parent_from_link)
        );
    }
    let mut taxels_of: Vec<Vec<&Taxel>> = vec![Vec::new(); body.links.len()];
    let felt = body.taxels.iter().filter(|taxel| taxel.modality.is_pressed());
    felt.for_each(|taxel| taxels_of[taxel.link].push(taxel));
    for (link, own) in body.links.iter().zip(taxels_of).filter(|(_, own)| !own.is_empty()) {
        let name = escaped(&link.name);
        let _ = writeln!(
            text,
            "  <sensor name=\"{name} skin\" update_rate=\"100\">\n    <parent link=\"{name}\"/>\n    <origin xyz=\"0 0 0\" \
             rpy=\"0 0 0\"/>\n    <tactile channel=\"{CHANNEL}\">"
        );
        own.into_iter().for_each(|taxel| put_taxel(taxel, &mut text));
        text += "    </tactile>\n  </sensor>\n";
    }
    text += "</robot>\n";
    let others = body.taxels.iter().filter(|taxel| !taxel.modality.is_pressed()).count();
    let with_axes = body.taxels.iter().filter(|taxel| taxel.modality == Modality::Force3).count();
    let mut notes = Vec::new();
    if with_axes > 0 {
        notes.push(format!(
            "{with_axes} taxels have three axes, for two of which a URDF has no place: they are written as taxels of pressure"
        ));
    }
    if others > 0 {
        notes.push(format!(
            "{others} taxels measure something else than pressure, for which a URDF has no place: left out"
        ));
    }
    let odd: Vec<&str> =
        body.links.iter().map(|link| link.name.as_str()).filter(|n| !n.chars().all(plain::is_xml)).collect();
    if let [first, ..] = odd[..] {
        notes.push(format!(
            "XML has no place for some characters in the names of {} links, the first `{first}`: they are written as \\uXXXX",
            odd.len()
        ));
    }
    (text, notes)
}

/// A link above all, if the roots are several, or one that does not stand at the origin.
fn base(body: &Body) -> Option<String> {
    let roots: Vec<_> = body.links.iter().filter(|link| link.parent.is_none()).collect();
    if roots.len() == 1 && roots[0].world_from_link().abs_diff_eq(DAffine3::IDENTITY, 1e-12) {
        return None;
    }
    let is_free = |name: &String| body.link_index(name).is_none();
    std::iter::once("base".to_owned()).chain((2..).map(|number| format!("base_{number}"))).find(is_free)
}

fn put_taxel(taxel: &Taxel, text: &mut String) {
    let normal = taxel.normal_in_link;
    // z is turned to the normal by a roll, then a pitch.
    let roll = libm::atan2(-normal.y, libm::hypot(normal.x, normal.z));
    let pitch = libm::atan2(normal.x, normal.z);
    let xyz = numbers(taxel.position_in_link);
    let _ = write!(
        text,
        "      <taxel idx=\"{}\" xyz=\"{xyz}\" rpy=\"{}\"",
        taxel.id,
        numbers(DVec3::new(roll, pitch, 0.0))
    );
    if taxel.area > 0.0 {
        let side = taxel.area.sqrt();
        let size = numbers(DVec3::new(side, side, BOX_DEPTH_M));
        let _ = writeln!(text, "><geometry><box size=\"{size}\"/></geometry></taxel>");
    } else {
        *text += "/>\n";
    }
}

/// The attributes `xyz` and `rpy` of a rigid transform.
fn pose(way: &DAffine3) -> String {
    let m = way.matrix3;
    let across = libm::hypot(m.x_axis.x, m.x_axis.y);
    let pitch = libm::atan2(-m.x_axis.z, across);
    // Pitched by a right angle, roll and yaw turn about one axis.
    let (roll, yaw) = if across > 1e-9 {
        (libm::atan2(m.y_axis.z, m.z_axis.z), libm::atan2(m.x_axis.y, m.x_axis.x))
    } else {
        (libm::atan2(-m.z_axis.y, m.y_axis.y), 0.0)
    };
    format!("xyz=\"{}\" rpy=\"{}\"", numbers(way.translation), numbers(DVec3::new(roll, pitch, yaw)))
}

fn numbers(v: DVec3) -> String {
    // −0 is 0.
    let [x, y, z] = v.to_array().map(|x| x + 0.0);
    format!("{x} {y} {z}")
}

/// `name` as the value of an attribute, from which a reader has every character back that XML can hold.
fn escaped(name: &str) -> String {
    let mut escaped = String::new();
    for c in plain::xml(name).chars() {
        match c {
            '&' => escaped += "&amp;",
            '<' => escaped += "&lt;",
            '>' => escaped += "&gt;",
            '"' => escaped += "&quot;",
            '\t' | '\n' | '\r' => {
                let _ = write!(escaped, "&#{};", u32::from(c));
            }
            c => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DQuat, EulerRot};

    #[test]
    fn a_pose_reads_back_also_where_angles_are_not_unique() {
        let near = std::f64::consts::FRAC_PI_2;
        for [roll, pitch, yaw] in
            [[0.1, 0.2, 0.3], [3.0, -1.5, -3.1], [0.4, near, 0.0], [-2.0, -near, 0.0], [0.7, near, 1.1], [0.0; 3]]
        {
            let turn = DQuat::from_euler(EulerRot::ZYX, yaw, pitch, roll);
            let way = DAffine3::from_rotation_translation(turn, DVec3::new(1.0, -2.0, 3e-9));
            let text = pose(&way);
            let [_, xyz, _, rpy, _] = text.split('"').collect::<Vec<_>>()[..] else { panic!("{text}") };
            let read =
                |text: &str| DVec3::from_slice(&text.split(' ').map(|x| x.parse().unwrap()).collect::<Vec<f64>>());
            let rpy = read(rpy);
            let back =
                DAffine3::from_rotation_translation(DQuat::from_euler(EulerRot::ZYX, rpy.z, rpy.y, rpy.x), read(xyz));
            assert!(back.abs_diff_eq(way, 1e-9), "{text}: {back:?} for {way:?}");
        }
    }
}
