//! Rays against triangles: whether any is hit, and which way each is crossed.
//!
//! The test is watertight (Woop, Benthin and Wald, *Watertight Ray/Triangle Intersection*, 2013): a ray cannot pass between
//! two triangles that share an edge.

use glam::DVec3;

use super::surface::area_vector;

/// Maximum number of triangles in a leaf.
const LEAF: usize = 4;

/// Bins per axis in which the surface area heuristic looks for the best split.
const BINS: usize = 12;

/// Depth from which splits go by number, so that any tree fits the stack.
const MAX_GUIDED_DEPTH: usize = 32;

/// Triangles with a hierarchy of boxes around them.
pub struct RayTree {
    nodes: Vec<Node>,
    triangles: Vec<[DVec3; 3]>,
}

/// A box, and two nodes or some triangles in it.
#[derive(Clone, Copy)]
struct Node {
    low: [f32; 3],
    high: [f32; 3],
    /// The second child, whose sibling comes after this node; or the first triangle.
    next: u32,
    /// Number of triangles; 0 if it has children.
    count: u32,
}

/// A half-line, and what the tests need of it.
pub struct Ray {
    origin: DVec3,
    direction: DVec3,
    inverse: DVec3,
    /// The axes, the one along which it runs most last.
    axes: [usize; 3],
    shear: DVec3,
}

impl Ray {
    /// From `origin` along `direction`, of any length.
    pub fn new(origin: DVec3, direction: DVec3) -> Self {
        let length = direction.abs();
        let z = if length.x >= length.y && length.x >= length.z {
            0
        } else if length.y >= length.z {
            1
        } else {
            2
        };
        let (x, y) = ((z + 1) % 3, (z + 2) % 3);
        let along = direction[z];
        let shear = DVec3::new(direction[x] / along, direction[y] / along, 1.0 / along);
        Self { origin, direction, inverse: direction.recip(), axes: [x, y, z], shear }
    }

    /// Whether it meets the triangle.
    fn hits(&self, corners: &[DVec3; 3]) -> bool {
        let [x, y, z] = self.axes;
        let [a, b, c] = corners.map(|corner| corner - self.origin);
        let flat = |p: DVec3| [p[x] - self.shear.x * p[z], p[y] - self.shear.y * p[z]];
        let [[ax, ay], [bx, by], [cx, cy]] = [a, b, c].map(flat);
        let (u, v, w) = (cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax);
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return false;
        }
        let whole = u + v + w;
        let distance = self.shear.z * (u * a[z] + v * b[z] + w * c[z]);
        whole != 0.0 && if whole > 0.0 { distance > 0.0 } else { distance < 0.0 }
    }

    fn enters(&self, node: &Node) -> bool {
        let (mut near, mut far) = (0.0_f64, f64::INFINITY);
        for axis in 0..3 {
            let low = (f64::from(node.low[axis]) - self.origin[axis]) * self.inverse[axis];
            let high = (f64::from(node.high[axis]) - self.origin[axis]) * self.inverse[axis];
            // A ray that runs within a side of the box, where 0 · ∞ is not a number, is not kept out by that side's slab.
            if low.is_nan() || high.is_nan() {
                continue;
            }
            near = near.max(low.min(high));
            far = far.min(low.max(high));
        }
        // Three roundings of a double each.
        near <= far * (1.0 + 8.0 * f64::EPSILON)
    }
}

impl RayTree {
    /// The tree of `triangles`; those with a corner that is not finite are left out.
    pub fn new(triangles: impl IntoIterator<Item = [DVec3; 3]>) -> Self {
        let is_sound = |corners: &[DVec3; 3]| corners.iter().all(|corner| corner.is_finite());
        let mut items: Vec<([DVec3; 3], DVec3)> = triangles
            .into_iter()
            .filter(is_sound)
            .map(|corners| (corners, corners.iter().sum::<DVec3>() / 3.0))
            .collect();
        let mut nodes = Vec::with_capacity(items.len() / 2 + 1);
        if !items.is_empty() {
            build(&mut items, 0, 0, &mut nodes);
        }
        Self { nodes, triangles: items.into_iter().map(|(corners, _)| corners).collect() }
    }

    /// Whether `ray` meets any triangle.
    pub fn is_hit(&self, ray: &Ray) -> bool {
        let mut found = false;
        self.walk(ray, |_| {
            found = true;
            false
        });
        found
    }

    /// How often `ray` goes out through the triangles' outside, less how often it comes in.
    pub fn crossings(&self, ray: &Ray) -> i64 {
        let mut sum = 0;
        self.walk(ray, |corners| {
            let along = area_vector(*corners).dot(ray.direction);
            sum += if along > 0.0 { 1 } else { -1 };
            true
        });
        sum
    }

    /// Calls `hit` with each triangle that `ray` meets, until it returns false.
    fn walk(&self, ray: &Ray, mut hit: impl FnMut(&[DVec3; 3]) -> bool) {
        let mut waiting = [0_u32; 2 * MAX_GUIDED_DEPTH + 2];
        let mut count = usize::from(!self.nodes.is_empty());
        while count > 0 {
            count -= 1;
            let index = waiting[count];
            let node = &self.nodes[index as usize];
            if !ray.enters(node) {
                continue;
            }
            if node.count == 0 {
                waiting[count] = node.next;
                waiting[count + 1] = index + 1;
                count += 2;
                continue;
            }
            for corners in &self.triangles[node.next as usize..][..node.count as usize] {
                if ray.hits(corners) && !hit(corners) {
                    return;
                }
            }
        }
    }
}

/// Puts the node over `items`, which come after `first` others, and all below it at the end of `nodes`.
fn build(items: &mut [([DVec3; 3], DVec3)], first: usize, depth: usize, nodes: &mut Vec<Node>) {
    let (low, high) = bounds(items);
    let index = nodes.len();
    let down = |x: f64| if f64::from(x as f32) > x { (x as f32).next_down() } else { x as f32 };
    let up = |x: f64| if f64::from(x as f32) < x { (x as f32).next_up() } else { x as f32 };
    let (low, high) = (low.to_array().map(down), high.to_array().map(up));
    nodes.push(Node { low, high, next: first as u32, count: items.len() as u32 });
    if items.len() <= LEAF {
        return;
    }
    let middle = split(items, depth);
    let (before, after) = items.split_at_mut(middle);
    build(before, first, depth + 1, nodes);
    let next = nodes.len() as u32;
    build(after, first + middle, depth + 1, nodes);
    nodes[index] = Node { low, high, next, count: 0 };
}

fn bounds(items: &[([DVec3; 3], DVec3)]) -> (DVec3, DVec3) {
    let corners = items.iter().flat_map(|(corners, _)| corners);
    corners.fold((DVec3::MAX, DVec3::MIN), |(low, high), &corner| (low.min(corner), high.max(corner)))
}

/// Half the area of a box.
fn area((low, high): (DVec3, DVec3)) -> f64 {
    let size = (high - low).max(DVec3::ZERO);
    size.x * size.y + size.y * size.z + size.z * size.x
}

/// Orders `items` and returns how many come into the first of two nodes.
fn split(items: &mut [([DVec3; 3], DVec3)], depth: usize) -> usize {
    let (low, high) = items.iter().fold((DVec3::MAX, DVec3::MIN), |(low, high), (_, at)| (low.min(*at), high.max(*at)));
    let size = high - low;
    let axis = if size.x >= size.y && size.x >= size.z { 0 } else { usize::from(size.y < size.z) + 1 };
    let half = items.len() / 2;
    if depth < MAX_GUIDED_DEPTH && size[axis] > 0.0 {
        let bin = |at: &DVec3| (((at[axis] - low[axis]) / size[axis] * BINS as f64) as usize).min(BINS - 1);
        let empty = (0_usize, (DVec3::MAX, DVec3::MIN));
        let mut bins = [empty; BINS];
        for (corners, at) in items.iter() {
            let (count, (low, high)) = &mut bins[bin(at)];
            *count += 1;
            for &corner in corners {
                (*low, *high) = (low.min(corner), high.max(corner));
            }
        }
        let joined =
            |a: (usize, (DVec3, DVec3)), b: (usize, (DVec3, DVec3))| (a.0 + b.0, (a.1.0.min(b.1.0), a.1.1.max(b.1.1)));
        let cost =
            |(count, bounds): (usize, (DVec3, DVec3))| if count == 0 { 0.0 } else { count as f64 * area(bounds) };
        let mut best = (f64::INFINITY, 0);
        for cut in 1..BINS {
            let before = bins[..cut].iter().copied().fold(empty, joined);
            let after = bins[cut..].iter().copied().fold(empty, joined);
            let whole = cost(before) + cost(after);
            if before.0 > 0 && after.0 > 0 && whole < best.0 {
                best = (whole, cut);
            }
        }
        if best.1 > 0 {
            let mut middle = 0;
            for index in 0..items.len() {
                if bin(&items[index].1) < best.1 {
                    items.swap(middle, index);
                    middle += 1;
                }
            }
            return middle;
        }
    }
    items.select_nth_unstable_by(half, |a, b| a.1[axis].total_cmp(&b.1[axis]));
    half
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ball of triangles with the outside out.
    fn ball(rings: u32) -> Vec<[DVec3; 3]> {
        let around = 2 * rings;
        let at = |ring: u32, step: u32| {
            let (down, turn) = (
                std::f64::consts::PI * f64::from(ring) / f64::from(rings),
                std::f64::consts::TAU * f64::from(step % around) / f64::from(around),
            );
            let radius = if ring == 0 || ring == rings { 0.0 } else { down.sin() };
            DVec3::new(radius * turn.cos(), radius * turn.sin(), down.cos())
        };
        let quads = (0..rings).flat_map(|ring| (0..around).map(move |step| (ring, step)));
        quads
            .flat_map(|(ring, step)| {
                let [a, b, c, d] = [at(ring, step), at(ring + 1, step), at(ring + 1, step + 1), at(ring, step + 1)];
                [[a, b, c], [a, c, d]]
            })
            .collect()
    }

    #[test]
    fn no_ray_leaves_a_ball_between_its_triangles() {
        let triangles = ball(20);
        let tree = RayTree::new(triangles.iter().copied());
        // At corners and middles of edges, where others slip through; and everywhere else.
        let targets = triangles.iter().flat_map(|&[a, b, c]| [a, (a + b) / 2.0, (b + c) / 2.0, (a + b + c) / 3.0]);
        let mut rays = 0;
        for target in targets {
            for origin in [DVec3::ZERO, DVec3::new(0.3, -0.2, 0.5)] {
                assert!(tree.is_hit(&Ray::new(origin, (target - origin).normalize())), "{origin} to {target}");
                rays += 1;
            }
        }
        assert!(rays > 5000);
        for axis in DVec3::AXES {
            assert!(tree.is_hit(&Ray::new(DVec3::ZERO, axis)) && tree.is_hit(&Ray::new(DVec3::ZERO, -axis)));
            assert!(!tree.is_hit(&Ray::new(2.0 * axis, axis)), "what lies behind is not hit");
            assert!(tree.is_hit(&Ray::new(2.0 * axis, -axis)));
        }
    }

    #[test]
    fn a_tree_hits_what_its_triangles_do_and_counts_ways_in_and_out() {
        let triangles = ball(9);
        let tree = RayTree::new(triangles.iter().copied());
        let mut state = 7_u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 33) as f64 / f64::from(1_u32 << 30) - 1.0
        };
        let mut hits = 0;
        for _ in 0..2000 {
            let origin = DVec3::new(next(), next(), next()) * 1.5;
            let ray = Ray::new(origin, DVec3::new(next(), next(), next()).normalize());
            let by_hand = triangles.iter().any(|corners| ray.hits(corners));
            assert_eq!(tree.is_hit(&ray), by_hand);
            hits += usize::from(by_hand);
            let expected = i64::from(origin.length() < 0.96);
            if origin.length() < 0.96 || origin.length() > 1.0 {
                assert_eq!(tree.crossings(&ray), expected, "{origin}");
            }
        }
        assert!(hits > 300 && hits < 1900, "{hits}");
        let inside_out = RayTree::new(triangles.iter().map(|&[a, b, c]| [a, c, b]));
        assert_eq!(inside_out.crossings(&Ray::new(DVec3::ZERO, DVec3::new(0.6, 0.1, 0.79))), -1);
    }

    #[test]
    fn a_ray_along_the_side_of_a_box_is_not_lost() {
        // Many triangles whose boxes begin exactly at x = 0, and a ray within that plane.
        let along = (0..40).map(|step| {
            let z = f64::from(step);
            [DVec3::new(0.0, -1.0, z), DVec3::new(1.0, 0.0, z), DVec3::new(0.0, 1.0, z)]
        });
        let tree = RayTree::new(along);
        let ray = Ray::new(DVec3::new(0.0, 0.1, -1.0), DVec3::Z);
        assert!(tree.is_hit(&ray));
        assert_eq!(tree.crossings(&ray), 40);
    }

    #[test]
    fn equal_and_damaged_triangles_make_a_tree() {
        let one = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let bad = [DVec3::NAN, DVec3::X, DVec3::Y];
        let tree = RayTree::new(std::iter::repeat_n(one, 1000).chain([bad]));
        let ray = Ray::new(DVec3::new(0.2, 0.2, 1.0), -DVec3::Z);
        assert_eq!(tree.crossings(&ray), -1000);
        let none = RayTree::new([]);
        assert!(!none.is_hit(&ray));
    }
}
