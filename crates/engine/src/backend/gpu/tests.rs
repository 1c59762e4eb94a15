//! What holds the shaders to the Rust beside them, on machines without any driver too.

use std::mem::{offset_of, size_of};

use naga::valid::{Capabilities, ValidationFlags, Validator};
use naga::{Module, TypeInner};

use super::columns::NOTHING;
use super::pack::Form;
use super::shaders::{Abreast, CALIBRATE, CHANGE, Members, Shader, Values, all, narrow_fields, wide_fields};
use super::stage::{GROUP, folded, pipeline};
use somatic_testing::skip;

use super::{Gpu, adapter};
use crate::backend::{Backend, BackendState, RawBatch, Rows, Step};
use crate::body::Body;
use crate::field::FieldSet;
use crate::percept::{Flags, Outputs, Percepts, Precision};
use crate::scene::{Plan, Scene};
use crate::signal::{Calibration, RawValue};
use crate::stage::layout::PRESENT;
use crate::stage::{calibrate, layout};

fn parse(shader: &Shader) -> Module {
    let text = shader.wgsl();
    naga::front::wgsl::parse_str(&text).unwrap_or_else(|e| panic!("{}: {}", shader.name, e.emit_to_string(&text)))
}

/// (name, offset) of every member of the WGSL struct `name`, and its size.
fn members(module: &Module, name: &str) -> (Vec<(String, u32)>, u32) {
    let (_, found) = module.types.iter().find(|(_, t)| t.name.as_deref() == Some(name)).expect("the struct is there");
    let TypeInner::Struct { members, span } = &found.inner else { panic!("{name} is not a struct") };
    (members.iter().map(|m| (m.name.clone().unwrap_or_default(), m.offset)).collect(), *span)
}

macro_rules! same_layout {
    ($module:expr, $type:ident { $($field:ident),* $(,)? }) => {
        let (members, span) = members($module, stringify!($type));
        let ours = vec![$((stringify!($field).to_owned(), offset_of!(layout::$type, $field) as u32)),*];
        assert_eq!(members, ours, stringify!($type));
        assert_eq!(span as usize, size_of::<layout::$type>(), stringify!($type));
    };
}

#[test]
fn structs_lie_as_naga_lays_them() {
    let module = parse(&wide_fields(Abreast::Four, Values::Pressures, Members::Many));
    same_layout!(&module, Batch { frames, channels, calibrated, changes, fields, lanes_log2 });
    same_layout!(&module, Taxel { baseline, gain, dead_band, p_max, raw_low, raw_high, area, response });
    same_layout!(&module, Curve { first, count });
    same_layout!(&module, Knot { raw, p, slope });
    same_layout!(&module, Field { first, count, known, index });
    same_layout!(&module, Part { members, number, first, count, before });
    same_layout!(&module, Member { slot, weight, u, v });
    same_layout!(&module, Step { dt_s, flags });
    same_layout!(&module, Still { least, rounding, per_taxel });
}

/// The value of the integer constant `name`.
fn constant(module: &Module, name: &str) -> Option<u32> {
    let (_, found) = module.constants.iter().find(|(_, c)| c.name.as_deref() == Some(name))?;
    match module.global_expressions[found.init] {
        naga::Expression::Literal(naga::Literal::U32(value)) => Some(value),
        _ => panic!("{name} is not a u32"),
    }
}

#[test]
fn bits_have_one_meaning() {
    let module = parse(&CALIBRATE);
    for (name, flag) in Flags::all().iter_names() {
        // A shader names the flags it sets; whatever it names must be the same bit.
        if let Some(bits) = constant(&module, name) {
            assert_eq!(bits, flag.bits(), "{name}");
        }
    }
    for name in ["NO_CONTACT", "ONE_TAXEL", "TIE", "COINCIDENT", "ISOTROPIC", "SATURATED", "FAULTY_INPUT", "NO_CHART"] {
        assert!(constant(&module, name).is_some(), "{name}");
    }
    for (name, output) in Outputs::all().iter_names() {
        if let Some(bits) = constant(&module, name) {
            assert_eq!(bits, output.low(), "{name}");
            assert!(bits < 1 << (32 - PRESENT), "{name} has no room in a cell's status");
        }
    }
    // The host's own flags stand above those that the device has room for.
    let shared = Flags::all().bits() & ((1 << PRESENT) - 1);
    assert_eq!(constant(&module, "FLAGS"), Some(shared));
    let of_host = Flags::HELD | Flags::JUMPED | Flags::DRIFT_UNKNOWN | Flags::NO_UNIT;
    let of_host = of_host | Flags::NO_GRADIENT | Flags::STALE_POSE | Flags::NO_POSE;
    let of_sigma = Flags::NOISE_UNKNOWN | Flags::UNSURE;
    assert_eq!(Flags::all().bits() - shared, (of_host | of_sigma).bits());
    assert_eq!(constant(&module, "PRESENT"), Some(PRESENT));
    assert_eq!(constant(&module, "GROUP"), Some(GROUP));
    let one = parse(&narrow_fields(Abreast::One, Values::Raw, Members::Few));
    assert_eq!(constant(&one, "FIELDS_GROUP"), Some(super::stage::FIELDS_GROUP));
    assert_eq!(constant(&module, "CHARTED"), Some(layout::CHARTED));
    assert_eq!(constant(&module, "AREA_KNOWN"), Some(layout::AREA_KNOWN));
    assert_eq!(constant(&module, "STRAIGHT"), Some(layout::STRAIGHT));
    assert_eq!(constant(&module, "MASKED"), Some(layout::MASKED));
    assert_eq!(constant(&module, "FIRST_CURVE"), Some(layout::FIRST_CURVE));
    assert_eq!(constant(&module, "STATUS"), Some(Flags::SATURATED.bits().trailing_zeros()));
    // Every flag that a taxel can have lies in a byte from there on, and what leaves it out above them.
    let of_taxels = Flags::SATURATED | Flags::FAULTY_INPUT | Flags::OUT_OF_RANGE | Flags::INCOMPLETE;
    let of_taxels = of_taxels | Flags::NO_PREVIOUS | Flags::BAD_DT;
    assert_eq!(constant(&module, "UNUSABLE"), Some(((of_taxels.bits() >> 6) + 1).next_power_of_two()));
    assert_eq!(constant(&module, "TURNS"), Some(super::stage::TURNS));
    assert_eq!(constant(&module, "HUGE_BITS"), Some(calibrate::HUGE_BITS));
    assert_eq!(constant(&module, "TINY_BITS"), Some(calibrate::TINY_BITS));
    let change = parse(&CHANGE);
    assert_eq!(constant(&change, "HUGE_BITS"), Some(calibrate::HUGE_BITS));
    assert_eq!(constant(&change, "TINY_BITS"), Some(calibrate::TINY_BITS));
    assert_eq!(constant(&module, "MISSING"), Some(RawValue::MISSING.to_bits()));
}

#[test]
fn every_shader_validates_with_no_optional_capability() {
    for shader in &all() {
        let module = parse(shader);
        let validated = Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&module);
        let info = validated.unwrap_or_else(|e| panic!("{}: {e:?}", shader.name));
        for (number, entry) in module.entry_points.iter().enumerate() {
            let storage = module.global_variables.iter().filter(|(handle, variable)| {
                let is_used = !info.get_entry_point(number)[*handle].is_empty();
                is_used && matches!(variable.space, naga::AddressSpace::Storage { .. })
            });
            let count = storage.count();
            assert!((1..=8).contains(&count), "{} {} binds {count} buffers", shader.name, entry.name);
        }
    }
}

#[test]
fn every_shader_is_the_file_of_its_stage() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = somatic_shaders::STAGES.map(str::to_owned).to_vec();
    let mut stages: Vec<String> =
        all().iter().flat_map(|shader| shader.stages).map(|&stage| stage.to_owned()).collect();
    files.sort();
    stages.sort();
    stages.dedup();
    assert_eq!(files, stages);
    for stage in stages {
        let is_there =
            ["rs", ""].iter().any(|ending| folder.join("src/stage").join(&stage).with_extension(ending).exists());
        assert!(is_there, "{stage}");
        // Its sums go over members together with those of contact.
        let in_lanes = if stage == "centroid" { "contact" } else { &stage };
        assert!(folder.join(format!("src/backend/cpu/{in_lanes}.rs")).is_file(), "{stage}");
    }
}

#[test]
fn pipelines_build_without_any_driver() {
    let device = adapter::open(wgpu::Backends::NOOP).expect("noop is always there");
    for shader in &all() {
        for entry in parse(shader).entry_points {
            let built = pipeline(&device, shader, &entry.name, NOTHING);
            assert!(format!("{built:?}").contains("ComputePipeline"));
        }
    }
}

#[test]
fn a_shader_that_is_wrong_is_caught() {
    let sound = narrow_fields(Abreast::Four, Values::Pressures, Members::Many).wgsl();
    let broken = sound.replace("sums.total += pull;", "sums.total += Words(status);");
    assert!(broken != sound);
    assert!(
        naga::front::wgsl::parse_str(&broken).is_err() || {
            let module = naga::front::wgsl::parse_str(&broken).unwrap();
            Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&module).is_err()
        }
    );
}

#[test]
fn a_long_dispatch_is_folded() {
    assert_eq!(folded(1), (1, 1));
    assert_eq!(folded(65_535), (65_535, 1));
    for count in [65_536, 1_000_003, u32::MAX / 64] {
        let (wide, tall) = folded(count);
        assert!(wide <= 65_535 && tall <= 65_535 && u64::from(wide) * u64::from(tall) >= u64::from(count));
    }
}

#[test]
fn a_batch_is_cut_into_blocks_that_hold_it() {
    for frames in [1, 2, 4, 5, 9, 64, 130, 255, 256, 257, 1000, 9984] {
        let (lanes, quads) = (layout::lanes(frames), layout::padded_quads(frames));
        assert!(lanes.is_power_of_two() && lanes <= layout::LANES && layout::LANES <= GROUP);
        assert!(quads * 4 >= frames && quads % lanes as usize == 0);
        // A shorter batch never needs more than there is room for.
        assert!((1..frames).all(|fewer| layout::padded_quads(fewer) <= quads));
    }
}

/// A backend for the hand on a device that computes nothing.
fn on_noop() -> Gpu {
    let body = Body::from_bytes("hand", somatic_bodies::HAND).unwrap();
    let plan = plan_of(&body, &Scene::default());
    Gpu::on(adapter::open(wgpu::Backends::NOOP).unwrap(), &plan, 4).unwrap()
}

fn run(gpu: &mut Gpu) -> crate::error::Result<Percepts> {
    let values = vec![RawValue::new(1.0); gpu.plan.channels()];
    run_on(gpu, &values)
}

#[test]
fn a_device_that_is_lost_is_an_error_in_one_line_and_stays_one() {
    let mut gpu = on_noop();
    run(&mut gpu).unwrap();
    gpu.device.device.destroy();
    for _ in 0..2 {
        let error = run(&mut gpu).unwrap_err();
        assert!(error.kind() == crate::error::ErrorKind::DeviceLost && error.exit_code() == 1);
        let error = error.to_string();
        assert!(error.contains("stopped answering") && error.contains("cpu backend"), "{error}");
        assert_eq!(error.lines().count(), 1, "{error}");
    }
}

#[test]
fn an_error_that_nobody_asked_for_is_reported_by_the_next_call() {
    let mut gpu = on_noop();
    // A copy beyond a buffer's end, which no call of the backend's own makes.
    let mut encoder = gpu.device.encoder();
    encoder.copy_buffer_to_buffer(&gpu.raw, 0, &gpu.steps, 0, 1 << 30);
    gpu.device.queue.submit([encoder.finish()]);
    let error = run(&mut gpu).unwrap_err().to_string();
    assert!(error.contains("stopped answering") && error.lines().count() == 1, "{error}");
}

/// Percepts of `frames` frames of every odd value there is, among plain ones.
pub(super) fn percepts_of_odd_values(gpu: &mut Gpu, frames: usize) -> Percepts {
    let plan = gpu.plan.clone();
    let odd =
        [0, 1 << 31, 1, u32::MAX, f32::INFINITY.to_bits(), f32::NAN.to_bits(), 0x2180_0000, 0x217f_ffff, 0x5d80_0001];
    let value = |i: usize| match i % 19 {
        0 => bytemuck::cast(odd[i / 19 % odd.len()]),
        1 => RawValue::new(-3.0),
        _ => RawValue::new((i * i % 1023 + 1) as f64),
    };
    percepts_of(gpu, &(0..frames * plan.channels()).map(value).collect::<Vec<_>>())
}

/// Percepts of frames of `values`, one after the other.
pub(super) fn percepts_of(gpu: &mut Gpu, values: &[RawValue]) -> Percepts {
    run_on(gpu, values).unwrap()
}

fn run_on(gpu: &mut Gpu, values: &[RawValue]) -> crate::error::Result<Percepts> {
    let (channels, frames) = (gpu.plan.channels(), values.len() / gpu.plan.channels());
    let steps = vec![Step { dt_s: 0.01, flags: Flags::empty() }; frames];
    let mut percepts = Percepts::new(gpu.plan.outputs, gpu.plan.fields.len(), Precision::F32)
        .with_columns(gpu.plan.columns, gpu.plan.kept_pressures());
    percepts.reset(frames);
    let rows = Rows::Packed { values, channels };
    gpu.run(&RawBatch { first: 0, frames, rows, steps: &steps }, &mut percepts)?;
    Ok(percepts)
}

pub(super) fn plan_of(body: &Body, scene: &Scene) -> Plan {
    Plan::new(body, &FieldSet::new(body).unwrap(), scene, &Calibration::identity(body.taxels.len())).unwrap()
}

#[test]
fn raw_values_are_read_alike_as_they_come_and_through_calibration() {
    let Ok(device) = adapter::shared() else { return skip("GPU", "no adapter answers") };
    let body = Body::from_bytes("hand", somatic_bodies::HAND).unwrap();
    let scene = Scene { outputs: Outputs::USUAL_AND_MOTION - Outputs::POSITION - Outputs::NORMAL, ..Scene::default() };
    let plan = plan_of(&body, &scene);
    // One that must be calibrated, though nothing comes of it: what is so small counts as 0 anyway.
    let mut calibrated = plan.clone();
    calibrated.taxels[0].dead_band = 1e-30;
    for frames in [1, 7, 70, 300] {
        let mut gpu = Gpu::on(device.clone(), &plan, frames).unwrap();
        assert!(gpu.packer.form != Form::Rows);
        let percepts = percepts_of_odd_values(&mut gpu, frames);
        gpu.restore(&BackendState::initial(&plan)).unwrap();
        gpu.recalibrate(&calibrated);
        assert!(gpu.packer.form == Form::Rows);
        assert!(percepts == percepts_of_odd_values(&mut gpu, frames), "{frames} frames");
        let faulty = (0..frames)
            .flat_map(|frame| percepts.frame(frame))
            .filter(|percept| percept.flags.contains(Flags::FAULTY_INPUT | Flags::INCOMPLETE));
        assert!(frames < 70 || faulty.count() > 0);
    }
}
