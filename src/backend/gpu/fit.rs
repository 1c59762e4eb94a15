//! fit on the device: where the descents of contacts end, for all touches of a call; see [`crate::stage::fit`].
//!
//! One invocation descends for one touch and kind. Touches with about as many sensors make a group, as its invocations wait for the one
//! with most; their sensors lie side by side, so that neighbours read neighbouring words.

use bytemuck::{Pod, cast_slice, pod_collect_to_vec};

use super::adapter::Device;
use super::shaders::Shader;
use super::stage::{GROUP, pipeline};
use crate::error::Result;
use crate::stage::fit::{Ends, Sensor, Shape, Start, Touch, fit_alone};
use crate::stage::layout::{FitSensor, FitShape, FitStart, WIDE};

/// Kinds of contact, as the shader counts them.
pub(super) const KINDS: usize = 4;
/// Rows of sensors in a submission, about: 16 MiB, enough to keep a GPU busy.
const ROWS: usize = 10_000;
/// A touch of more sensors is the CPU's: lavapipe ends an invocation's loops after 65,535 rounds in all, of which a segment makes fifteen
/// a sensor.
const MOST: usize = WIDE;

/// The descents' program and its buffers, which grow to what calls need.
pub(super) struct Descents {
    pipeline: wgpu::ComputePipeline,
    sensors: wgpu::Buffer,
    starts: wgpu::Buffer,
    rows: wgpu::Buffer,
    ends: wgpu::Buffer,
    back: wgpu::Buffer,
}

/// Touches that go up together.
#[derive(Default)]
struct Load {
    /// By group its first row.
    rows: Vec<u32>,
    sensors: Vec<FitSensor>,
    starts: Vec<FitStart>,
}

impl Load {
    fn rows(&self) -> usize {
        self.sensors.len() / GROUP as usize
    }

    /// Adds a group of touches, the last of which has most sensors.
    fn push(&mut self, group: &[(&Touch, Start<f64>)]) {
        let (first, group_size) = (self.rows(), GROUP as usize);
        let most = group.iter().map(|(touch, _)| touch.sensors().len()).max().unwrap_or(0);
        self.rows.push(first as u32);
        self.sensors.resize((first + most) * group_size, FitSensor::default());
        for (at, (touch, start)) in group.iter().enumerate() {
            for (row, sensor) in touch.sensors().iter().enumerate() {
                self.sensors[(first + row) * group_size + at] = rounded(sensor);
            }
            let [along_u, along_v] = start.line.along.map(|part| part as f32);
            self.starts.push(FitStart {
                along_u,
                along_v,
                point_width: start.point.width as f32,
                line_width: start.line.width as f32,
                blob_width: start.blob.width as f32,
                blob_length: start.blob.length as f32,
                half_length: start.half_length as f32,
                gain_variance: start.gain_variance as f32,
                count: touch.sensors().len() as u32,
                steps: start.steps as u32,
                is_long: start.is_long.into(),
            });
        }
        self.starts.resize(self.rows.len() * group_size, FitStart::default());
    }
}

fn rounded(sensor: &Sensor<f64>) -> FitSensor {
    FitSensor {
        u: sensor.at[0] as f32,
        v: sensor.at[1] as f32,
        margin: sensor.margin as f32,
        pressure: sensor.pressure as f32,
        variance: sensor.variance as f32,
        pressed: sensor.pressed as f32,
    }
}

fn widened(shape: &FitShape) -> Shape<f64> {
    Shape {
        place: [shape.u.into(), shape.v.into()],
        along: [shape.along_u.into(), shape.along_v.into()],
        force: shape.force.into(),
        width: shape.width.into(),
        length: shape.length.into(),
    }
}

impl Descents {
    /// By `shader`, that of fit.
    pub(super) fn new(device: &Device, shader: &Shader) -> Self {
        Self {
            pipeline: pipeline(device, shader, "main", &[]),
            sensors: storage(device, "sensors of touches", 0),
            starts: storage(device, "starts", 0),
            rows: storage(device, "rows", 0),
            ends: storage(device, "ends", 0),
            back: read_back(device, 0),
        }
    }

    /// Where the descents of `touches` end; none of one with too few taxels.
    pub(super) fn run(&mut self, device: &Device, touches: &[&Touch]) -> Result<Vec<Option<Ends<f64>>>> {
        let mut ends: Vec<Option<Ends<f64>>> = vec![None; touches.len()];
        let mut started: Vec<(usize, Start<f64>)> = Vec::with_capacity(touches.len());
        for (index, touch) in touches.iter().enumerate() {
            match touch.start() {
                Some(start) if touch.sensors().len() > MOST => {
                    ends[index] = Some(fit_alone(touch.sensors(), &start).ends(start.gain_variance));
                }
                Some(start) => started.push((index, start)),
                None => {}
            }
        }
        started.sort_by_key(|&(index, start)| (start.is_long, touches[index].sensors().len()));
        let (mut load, mut loaded) = (Load::default(), 0);
        for (number, group) in started.chunks(GROUP as usize).enumerate() {
            let group: Vec<(&Touch, Start<f64>)> =
                group.iter().map(|&(index, start)| (touches[index], start)).collect();
            load.push(&group);
            let done = (number * GROUP as usize) + group.len();
            if load.rows() >= ROWS || done == started.len() {
                let found = self.submit(device, &load)?;
                for (&(index, start), shapes) in started[loaded..done].iter().zip(found.chunks(KINDS)) {
                    let [point, line, segment, blob] = [0, 1, 2, 3].map(|kind| widened(&shapes[kind]));
                    let long = start.is_long.then_some([segment, blob]);
                    ends[index] = Some(Ends { point, line, long, gain_variance: start.gain_variance });
                }
                (load, loaded) = (Load::default(), done);
            }
        }
        Ok(ends)
    }

    /// Runs `load`, and waits for its ends.
    fn submit(&mut self, device: &Device, load: &Load) -> Result<Vec<FitShape>> {
        put(device, &mut self.sensors, "sensors of touches", &load.sensors);
        put(device, &mut self.starts, "starts", &load.starts);
        put(device, &mut self.rows, "rows", &load.rows);
        let size = (load.starts.len() * KINDS * size_of::<FitShape>()) as u64;
        if self.ends.size() < size {
            (self.ends, self.back) = (storage(device, "ends", size), read_back(device, size));
        }
        let buffers = [&self.sensors, &self.starts, &self.rows, &self.ends];
        let entries: Vec<wgpu::BindGroupEntry<'_>> = (0..)
            .zip(buffers)
            .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
            .collect();
        let bound = device.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("fit"),
            layout: &self.pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        let mut encoder = device.encoder();
        {
            let descriptor = wgpu::ComputePassDescriptor { label: Some("fit"), timestamp_writes: None };
            let mut pass = encoder.begin_compute_pass(&descriptor);
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &bound, &[]);
            // Points; lines and segments; blobs.
            pass.dispatch_workgroups(load.rows.len() as u32, 3, 1);
        }
        encoder.copy_buffer_to_buffer(&self.ends, 0, &self.back, 0, size);
        encoder.map_buffer_on_submit(&self.back, wgpu::MapMode::Read, 0..size, |_| {});
        let submission = device.queue.submit([encoder.finish()]);
        let until = wgpu::PollType::Wait { submission_index: Some(submission), timeout: None };
        device.device.poll(until).map_err(|e| device.lost(&e))?;
        device.check()?;
        let shapes = {
            let bytes = self.back.get_mapped_range(0..size).map_err(|e| device.lost(&e))?;
            pod_collect_to_vec(&bytes)
        };
        self.back.unmap();
        Ok(shapes)
    }
}

fn storage(device: &Device, name: &str, size: u64) -> wgpu::Buffer {
    let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC;
    device.buffer(name, size, usage)
}

fn read_back(device: &Device, size: u64) -> wgpu::Buffer {
    device.buffer("ends read back", size, wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST)
}

/// Writes `rows` into `buffer`, or into a larger one in its place.
fn put<T: Pod>(device: &Device, buffer: &mut wgpu::Buffer, name: &str, rows: &[T]) {
    let bytes: &[u8] = cast_slice(rows);
    if buffer.size() < bytes.len() as u64 {
        *buffer = storage(device, name, bytes.len() as u64);
    }
    device.queue.write_buffer(buffer, 0, bytes);
}

#[cfg(test)]
mod tests {
    use super::super::shaders;
    use super::super::skips::skip;
    use super::*;
    use crate::backend::cpu::fit::{fit_each, judge_each};
    use crate::backend::gpu::adapter;
    use crate::stage::fit::made_up::{LAYER, touches};
    use crate::stage::fit::running::Running;
    use crate::stage::fit::{Blob, Fits, Kind, Layer, Line, Point, Segment, descend, fit, numbers};

    fn device() -> Option<Device> {
        adapter::shared().inspect_err(|_| skip("GPU", "no adapter answers")).ok()
    }

    /// Where `steps` steps of `descents` end.
    fn ended(device: &Device, descents: &mut Descents, steps: usize) -> (Vec<Touch>, Vec<Ends<f64>>) {
        let touches = touches(Layer { steps, ..LAYER });
        let ends = descents.run(device, &touches.iter().collect::<Vec<_>>()).unwrap();
        (touches, ends.into_iter().map(|ends| ends.expect("it has taxels enough")).collect())
    }

    /// Parameters that were compared, and those whose bound says little: over a tenth of σ, of a radian, or of the parameter.
    #[derive(Default, Debug)]
    struct Compared {
        all: usize,
        loose: usize,
        /// How many are outside of their bounds, and the first of them.
        outside: usize,
        first_outside: Option<String>,
        /// Touches that have some.
        touches_outside: usize,
        /// The largest share of a bound that was used.
        used: f64,
    }

    impl Compared {
        /// Compares `end`, where the device came in one step from `start`, with the same step in double precision.
        fn add<M: Kind<K>, const K: usize>(
            &mut self,
            kind: &str,
            touch: &Touch,
            start: Shape<Running>,
            end: &Shape<f64>,
        ) {
            let lane = |sensor: &Sensor<f64>| Sensor::abreast([sensor], |[number]| Running::rounded(number));
            let sensors: Vec<Sensor<Running>> = touch.sensors().iter().map(lane).collect();
            let gains = Running::rounded(LAYER.gain_spread * LAYER.gain_spread);
            let right = descend::<Running, M, K>(&sensors, gains, start, 1).shape;
            let numbers = |shape: &Shape<f64>| {
                let &Shape { place: [u, v], along: [along_u, along_v], force, width, length } = shape;
                [u, v, along_u, along_v, force, width, length]
            };
            let Shape { place: [u, v], along: [along_u, along_v], force, width, length } = right;
            for (right, found) in [u, v, along_u, along_v, force, width, length].iter().zip(numbers(end)) {
                let off = (right.value - found).abs();
                self.all += 1;
                self.loose += usize::from(right.off > 0.1);
                self.used = self.used.max(off / right.off);
                if off > right.off {
                    self.outside += 1;
                    self.first_outside.get_or_insert(format!("{kind}: {off:e} of {:e}", right.off));
                }
            }
        }
    }

    /// `shape`, which the device has.
    fn exact(shape: &Shape<f64>) -> Shape<Running> {
        Shape::abreast([shape], |[number]| Running::exact(number))
    }

    /// Compares a step of all descents where the device has `numbers` with the same step in double precision under `layer`.
    fn compared(device: &Device, numbers: &[(String, f64)], layer: Layer) -> Compared {
        let mut descents = Descents::new(device, &shaders::fit(numbers));
        let (_, starts) = ended(device, &mut descents, 0);
        let (_, ends) = ended(device, &mut descents, 1);
        let mut compared = Compared::default();
        for ((touch, start), end) in touches(layer).iter().zip(&starts).zip(&ends) {
            let outside = compared.outside;
            compared.add::<Point, 4>("point", touch, exact(&start.point), &end.point);
            compared.add::<Line, 4>("line", touch, exact(&start.line), &end.line);
            if let (Some([segment, blob]), Some([to_segment, to_blob])) = (start.long, end.long) {
                // A segment starts from where the line has ended.
                let line = exact(&end.line);
                let length = Running::exact(segment.length);
                let from_line = Shape { force: line.force + length + std::f64::consts::LN_2, length, ..line };
                compared.add::<Segment, 6>("segment", touch, from_line, &to_segment);
                compared.add::<Blob, 6>("blob", touch, exact(&blob), &to_blob);
            }
            compared.touches_outside += usize::from(compared.outside > outside);
        }
        println!("{compared:?}");
        compared
    }

    #[test]
    fn a_step_is_within_its_running_bound_of_the_same_step_in_double_precision() {
        let Some(device) = device() else { return };
        let compared = compared(&device, &numbers(), LAYER);
        assert!(compared.outside == 0, "{compared:?}");
        assert!(compared.loose * 20 < compared.all, "{compared:?}");
    }

    #[test]
    fn a_step_under_other_numbers_is_outside_of_its_bound() {
        let Some(device) = device() else { return };
        // On lavapipe 60 of 61 touches have a parameter outside where the layer is wider by 10⁻⁴ of itself, by up to 2.8 times its bound;
        // and as many, by up to 4.3 times, where the device's own normal density is larger by 3 · 10⁻⁴ of itself.
        let wider = Layer { sigma_m: LAYER.sigma_m * (1.0 + 1e-4), ..LAYER };
        let mut denser = numbers();
        let (_, peak) =
            denser.iter_mut().find(|(name, _)| name == "PER_SQRT_TAU").expect("the shader has it from here");
        *peak *= 1.0 + 3e-4;
        for compared in [compared(&device, &numbers(), wider), compared(&device, &denser, LAYER)] {
            assert!(compared.touches_outside > 61 / 2, "{compared:?}");
        }
    }

    /// What the device has reached of each kind for `touches`, and what double precision has: cost, what is still ahead, and how far single
    /// precision may be off in the cost.
    fn reached(found: &[Fits<f64>], right: &[Fits<f64>], touches: &[Touch]) -> Vec<[f64; 5]> {
        let gains = LAYER.gain_spread * LAYER.gain_spread;
        let mut all = Vec::new();
        for ((found, right), touch) in found.iter().zip(right).zip(touches) {
            let lane = |sensor: &Sensor<f64>| Sensor::abreast([sensor], |[number]| Running::rounded(number));
            let sensors: Vec<Sensor<Running>> = touch.sensors().iter().map(lane).collect();
            let ends = found.ends(gains);
            let start = Start::abreast([&ends.start()], |[number]| Running::exact(number));
            let rounded = fit(&sensors, &start).reached();
            for ((found, right), rounded) in found.reached().iter().zip(right.reached()).zip(rounded) {
                all.push([found.0, found.1, right.0, right.1, rounded.0.off]);
            }
        }
        all
    }

    #[test]
    fn descents_reach_the_objective_that_double_precision_reaches() {
        let Some(device) = device() else { return };
        let mut descents = Descents::new(&device, &shaders::fit(&numbers()));
        let (touches, ends) = ended(&device, &mut descents, 6);
        let pointers: Vec<&Touch> = touches.iter().collect();
        let ends: Vec<_> = ends.into_iter().map(Some).collect();
        let found = judge_each(&pointers, &ends, |_, fits| *fits.unwrap());
        let right = fit_each(&pointers, |_, fits| *fits.unwrap());
        // At rest what is ahead is how far the cost is over the least one, to first order; twice that leaves room for what is beyond. Single
        // precision takes a step that helps by more than it can tell, twice the error of a cost, and may take six that cost as much.
        let is_within = |&[found, ahead, right, right_ahead, off]: &[f64; 5]| {
            (found - right).abs() <= 2.0 * (ahead + right_ahead) + 12.0 * off
        };
        let resting: Vec<[f64; 5]> =
            reached(&found, &right, &touches).into_iter().filter(|row| row[3] <= 0.01).collect();
        assert!(resting.len() > 150, "{} descents of {}", resting.len(), 4 * touches.len());
        let (mut ahead, mut off): (f64, f64) = (0.0, 0.0);
        for row in &resting {
            assert!(is_within(row), "{row:?}");
            (ahead, off) = (ahead.max(row[1]), off.max((row[0] - row[2]).abs()));
        }
        println!("{} at rest: at most {ahead:e} ahead, and {off:e} apart", resting.len());
        assert!(ahead <= 0.01, "what rests in double precision rests in single precision: {ahead:e}");
        // Negative control: under another layer they reach another objective.
        let others = self::touches(Layer { sigma_m: 2.2e-3, ..LAYER });
        let others = fit_each(&others.iter().collect::<Vec<_>>(), |_, fits| *fits.unwrap());
        let apart = reached(&found, &others, &touches);
        let (beyond, of) = apart
            .iter()
            .filter(|row| row[3] <= 0.01)
            .fold((0, 0), |(beyond, of), row| (beyond + usize::from(!is_within(row)), of + 1));
        assert!(beyond > of / 2, "{beyond} of {of}");
    }
}
