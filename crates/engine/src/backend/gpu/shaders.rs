//! The shaders' text: one file a stage, after what they share. The stages from contact to principal_axis are one program, put together
//! for where it reads and for how many frames it takes at once.

use std::borrow::Cow;

use somatic_shaders::shared;

use crate::percept::COLUMNS;
use crate::stage::layout::PRESENT;

/// A program's name, the stages that it computes, and its whole WGSL.
pub(crate) struct Shader {
    /// For people who look at the device's own log.
    pub(crate) name: &'static str,
    /// The stages, as everywhere.
    #[cfg_attr(not(test), expect(dead_code, reason = "tests hold the files of the stages to it"))]
    pub(crate) stages: &'static [&'static str],
    /// The text of its files, one after the other.
    files: Cow<'static, [&'static str]>,
}

impl Shader {
    /// WGSL, ready to compile: the outputs' bits come first.
    pub(crate) fn wgsl(&self) -> String {
        // Those that a cell's status has room for.
        let bits = COLUMNS.iter().map(|column| (column.shader_constant(), column.output.bits().ilog2()));
        let bits = bits.filter(|(_, bit)| *bit < u32::BITS - PRESENT);
        let bits: String = bits.map(|(name, bit)| format!("const {name} = 1u << {bit}u;\n")).collect();
        bits + &self.files.concat()
    }
}

/// A program of one stage.
macro_rules! shader {
    ($name:literal, $file:ident; $($shared:ident),*) => {
        Shader { name: $name, stages: &[$name], files: Cow::Borrowed(&[shared::LAYOUT $(, shared::$shared)*, somatic_shaders::$file]) }
    };
}

pub(crate) const CALIBRATE: Shader = shader!("calibrate", CALIBRATE; FOUR_FRAMES, MARKS);
pub(crate) const CHANGE: Shader = shader!("change", CHANGE; FOUR_FRAMES, MARKS);
pub(crate) const HYSTERESIS: Shader = shader!("hysteresis", HYSTERESIS;);
pub(crate) const MOTION: Shader = shader!("motion", MOTION; ANGLE);

/// Frames that an invocation of the program over fields takes at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Abreast {
    Four,
    /// Where there is never more than one.
    One,
}

/// Where it reads what taxels say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Values {
    /// What calibrate has written.
    Pressures,
    /// Raw values that are pressures, as they went up.
    Raw,
}

/// Where it reads members.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Members {
    Many,
    /// At most [`crate::stage::layout::FEW`] memberships.
    Few,
}

/// Contact, centroid, orientation and principal_axis, over fields that are not wide.
pub(crate) fn narrow_fields(abreast: Abreast, values: Values, members: Members) -> Shader {
    over_fields("fields", shared::NARROW_FIELDS, abreast, values, members)
}

/// The same over wide ones.
pub(crate) fn wide_fields(abreast: Abreast, values: Values, members: Members) -> Shader {
    over_fields("wide fields", shared::WIDE_FIELDS, abreast, values, members)
}

fn over_fields(name: &'static str, fields: &'static str, abreast: Abreast, values: Values, members: Members) -> Shader {
    let abreast = match abreast {
        Abreast::Four => [shared::FOUR_FRAMES, shared::FOUR_CELLS],
        Abreast::One => [shared::ONE_FRAME, shared::ONE_CELL],
    };
    let values = match values {
        Values::Pressures => &[shared::MARKS, shared::PRESSURES][..],
        Values::Raw => &[shared::RAW_PRESSURES],
    };
    let members = match members {
        Members::Many => shared::MEMBERS,
        Members::Few => shared::FEW_MEMBERS,
    };
    const SHARED: [&str; 4] = [shared::ANGLE, shared::SCALE, shared::OVER_FIELDS, shared::COMPENSATED];
    const STAGES: [&str; 4] = [
        somatic_shaders::CONTACT,
        somatic_shaders::CENTROID,
        somatic_shaders::ORIENTATION,
        somatic_shaders::PRINCIPAL_AXIS,
    ];
    let files = [&[shared::LAYOUT], &abreast[..], values, &[members], &SHARED, &[fields], &STAGES].concat();
    Shader { name, stages: &["contact", "centroid", "orientation", "principal_axis"], files: files.into() }
}

/// All of them, in the order they run.
#[cfg(test)]
pub(crate) fn all() -> Vec<Shader> {
    let mut all = vec![CALIBRATE, CHANGE];
    for abreast in [Abreast::Four, Abreast::One] {
        for values in [Values::Pressures, Values::Raw] {
            for members in [Members::Many, Members::Few] {
                all.push(narrow_fields(abreast, values, members));
                all.push(wide_fields(abreast, values, members));
            }
        }
    }
    all.extend([HYSTERESIS, MOTION]);
    all
}
