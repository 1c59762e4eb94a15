//! Sets of buffers that frames go up in and results come back in, taken in turns, so that packing, computing and reading
//! back overlap.

use std::sync::mpsc::{Receiver, Sender, channel};

use super::adapter::Device;
use crate::error::Result;

/// Sets: one that is packed, one that is computed, one that is read.
pub(super) const SETS: usize = 3;

/// The buffers of a submission.
pub(super) struct Set {
    /// Mapped, but for while a submission has it.
    pub(super) upload: wgpu::Buffer,
    pub(super) readback: wgpu::Buffer,
    mapped: Sender<Result<(), wgpu::BufferAsyncError>>,
    outcome: Receiver<Result<(), wgpu::BufferAsyncError>>,
    pub(super) pending: Option<Pending>,
}

/// A submission whose results are still to be taken.
pub(super) struct Pending {
    /// Of a call.
    pub(super) first: usize,
    pub(super) frames: usize,
    /// What comes back.
    bytes: u64,
    submission: wgpu::SubmissionIndex,
}

impl Set {
    pub(super) fn new(device: &Device, up: u64, back: u64) -> Self {
        let (mapped, outcome) = channel();
        Self {
            upload: device.buffer("upload", up, wgpu::BufferUsages::MAP_WRITE | wgpu::BufferUsages::COPY_SRC),
            readback: device.buffer("readback", back, wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST),
            mapped,
            outcome,
            pending: None,
        }
    }

    /// Submits `commands`, which fill the first `bytes` of the readback buffer with what `frames` frames give.
    pub(super) fn submit(
        &mut self,
        device: &Device,
        commands: wgpu::CommandBuffer,
        (first, frames): (usize, usize),
        bytes: u64,
    ) {
        let submission = device.queue.submit([commands]);
        let (read, written) = (self.mapped.clone(), self.mapped.clone());
        self.readback.map_async(wgpu::MapMode::Read, 0..bytes, move |result| {
            let _ = read.send(result);
        });
        self.upload.map_async(wgpu::MapMode::Write, .., move |result| {
            let _ = written.send(result);
        });
        self.pending = Some(Pending { first, frames, bytes, submission });
    }

    /// Waits for a submission, and lets `take` read what came back.
    pub(super) fn collect(&mut self, device: &Device, take: impl FnOnce(&Pending, &[u8])) -> Result<()> {
        let Some(pending) = self.pending.take() else { return Ok(()) };
        let until = wgpu::PollType::Wait { submission_index: Some(pending.submission.clone()), timeout: None };
        device.device.poll(until).map_err(|e| device.lost(&e))?;
        // Whatever went wrong before says more than that a buffer is not there.
        device.check()?;
        for _ in 0..2 {
            self.outcome.recv().map_err(|e| device.lost(&e))?.map_err(|e| device.lost(&e))?;
        }
        {
            let mapped = self.readback.get_mapped_range(0..pending.bytes).map_err(|e| device.lost(&e))?;
            take(&pending, &mapped);
        }
        self.readback.unmap();
        Ok(())
    }
}
