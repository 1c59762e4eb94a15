//! The humanoid's figure: bones, and the solids that give each its flesh. Metres; +x is its left, y up, +z forward.

use glam::DVec3;

use super::solid::{Ellipsoid, Solid, Taper, smooth_max, smooth_min};

/// A bone: a joint of the skeleton and what hangs on it.
pub(crate) struct Bone {
    /// Name of the link.
    pub(crate) link: String,
    /// Index of the bone above.
    pub(crate) parent: Option<usize>,
    /// Where its joint is, in the body's frame.
    pub(crate) joint: DVec3,
    /// Its flesh.
    solids: Vec<Box<dyn Solid>>,
    /// How widely the flesh runs over into that of other bones.
    fillet: f64,
}

impl Solid for Bone {
    fn distance(&self, p: DVec3) -> f64 {
        let distances = self.solids.iter().map(|solid| solid.distance(p));
        distances.reduce(|a, b| smooth_min(a, b, 0.03)).unwrap_or(f64::INFINITY)
    }
}

/// All the bones together, standing on the ground y = 0.
pub(crate) struct Figure {
    /// A bone comes after its parent.
    pub(crate) bones: Vec<Bone>,
}

impl Solid for Figure {
    fn distance(&self, p: DVec3) -> f64 {
        let flesh = self.bones.iter().fold(f64::INFINITY, |sum, bone| match (sum, bone.distance(p)) {
            (sum, distance) if sum.is_infinite() => distance,
            (sum, distance) => smooth_min(sum, distance, bone.fillet),
        });
        smooth_max(flesh, -p.y, 0.014)
    }
}

fn taper(a: [f64; 3], ra: f64, b: [f64; 3], rb: f64) -> Box<dyn Solid> {
    Box::new(Taper { a: a.into(), b: b.into(), ra, rb })
}

fn ellipsoid(centre: [f64; 3], radii: [f64; 3]) -> Box<dyn Solid> {
    Box::new(Ellipsoid { centre: centre.into(), axes: DVec3::AXES, radii: radii.into() })
}

/// The figure, 0.75 m tall.
pub(crate) fn figure() -> Figure {
    let mut bones = trunk();
    for (side, x) in [("left", 1.0), ("right", -1.0)] {
        arm(&mut bones, side, x);
        leg(&mut bones, side, x);
    }
    Figure { bones }
}

fn trunk() -> Vec<Bone> {
    let bone = |link: &str, parent, joint: [f64; 3], fillet, solids| Bone {
        link: link.to_owned(),
        parent,
        joint: joint.into(),
        solids,
        fillet,
    };
    let pelvis = vec![
        ellipsoid([0.0, 0.317, -0.002], [0.088, 0.062, 0.066]),
        ellipsoid([0.0, 0.304, -0.024], [0.070, 0.042, 0.040]),
    ];
    let spine = vec![ellipsoid([0.0, 0.385, 0.002], [0.079, 0.064, 0.062])];
    let chest = vec![
        ellipsoid([0.0, 0.474, 0.002], [0.094, 0.078, 0.066]),
        taper([0.070, 0.500, -0.006], 0.036, [-0.070, 0.500, -0.006], 0.036),
        ellipsoid([0.0, 0.462, 0.026], [0.066, 0.048, 0.044]),
    ];
    let neck = vec![taper([0.0, 0.525, -0.006], 0.040, [0.0, 0.590, 0.0], 0.031)];
    let head = vec![
        ellipsoid([0.0, 0.672, 0.0], [0.082, 0.078, 0.084]),
        ellipsoid([0.0, 0.640, 0.018], [0.066, 0.048, 0.068]),
        ellipsoid([0.080, 0.662, -0.004], [0.016, 0.026, 0.026]),
        ellipsoid([-0.080, 0.662, -0.004], [0.016, 0.026, 0.026]),
    ];
    vec![
        bone("pelvis", None, [0.0, 0.320, 0.0], 0.0, pelvis),
        bone("spine", Some(0), [0.0, 0.365, 0.0], 0.06, spine),
        bone("chest", Some(1), [0.0, 0.425, 0.0], 0.045, chest),
        bone("neck", Some(2), [0.0, 0.545, -0.005], 0.030, neck),
        bone("head", Some(3), [0.0, 0.595, 0.0], 0.024, head),
    ]
}

const CHEST: usize = 2;
const PELVIS: usize = 0;

/// Adds a bone for each `(segment, joint, fillet, solids)`, each on the one before it and the first on `root`.
fn chain(
    bones: &mut Vec<Bone>,
    side: &str,
    root: usize,
    segments: impl IntoIterator<Item = (&'static str, [f64; 3], f64, Vec<Box<dyn Solid>>)>,
) {
    let mut parent = root;
    for (segment, joint, fillet, solids) in segments {
        bones.push(Bone {
            link: format!("{side}_{segment}"),
            parent: Some(parent),
            joint: joint.into(),
            solids,
            fillet,
        });
        parent = bones.len() - 1;
    }
}

/// An arm held a little away from the body, on the side where x has the sign of `x`.
fn arm(bones: &mut Vec<Bone>, side: &str, x: f64) {
    let shoulder = [x * 0.108, 0.494, -0.006];
    let elbow = [x * 0.172, 0.396, -0.012];
    let wrist = [x * 0.222, 0.300, 0.006];
    let upper_arm = vec![taper(shoulder, 0.037, elbow, 0.029)];
    let bulge = [x * 0.187, 0.367, -0.008];
    let forearm = vec![taper(elbow, 0.0285, bulge, 0.0310), taper(bulge, 0.0310, wrist, 0.0240)];
    let along = (DVec3::from(wrist) - DVec3::from(elbow)).normalize();
    let across = (DVec3::Z - along * along.z).normalize();
    let mitten = Ellipsoid {
        centre: DVec3::from(wrist) + along * 0.050,
        axes: [along, across, along.cross(across)],
        radii: DVec3::new(0.053, 0.035, 0.021),
    };
    let thumb_root = DVec3::from(wrist) + along * 0.026 + across * 0.022;
    let thumb_tip = thumb_root + along * 0.028 + across * 0.026 - DVec3::X * (x * 0.006);
    let hand: Vec<Box<dyn Solid>> =
        vec![Box::new(mitten), taper(thumb_root.to_array(), 0.0135, thumb_tip.to_array(), 0.0115)];
    let segments =
        [("upper_arm", shoulder, 0.036, upper_arm), ("forearm", elbow, 0.016, forearm), ("hand", wrist, 0.014, hand)];
    chain(bones, side, CHEST, segments);
}

/// A leg, on the side where x has the sign of `x`.
fn leg(bones: &mut Vec<Bone>, side: &str, x: f64) {
    let hip = [x * 0.050, 0.300, 0.0];
    let knee = [x * 0.061, 0.176, 0.006];
    let ankle = [x * 0.066, 0.056, -0.008];
    let thigh = vec![taper(hip, 0.048, knee, 0.037)];
    let calf = [x * 0.064, 0.128, -0.008];
    let shank = vec![taper(knee, 0.0365, calf, 0.0375), taper(calf, 0.0375, ankle, 0.0265)];
    let foot = vec![
        taper([x * 0.067, 0.026, -0.024], 0.030, [x * 0.072, 0.020, 0.050], 0.032),
        ellipsoid([x * 0.073, 0.018, 0.056], [0.037, 0.026, 0.036]),
    ];
    let segments = [("thigh", hip, 0.022, thigh), ("shank", knee, 0.012, shank), ("foot", ankle, 0.016, foot)];
    chain(bones, side, PELVIS, segments);
}
