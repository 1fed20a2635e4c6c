//! What a pass records into.

use crate::{
    error::RunError,
    gpu::Gpu,
    ports::AnyShape,
    resource::{PartSet, Resource},
    timing::Timer,
};
use std::{ops::Range, time::Instant};

/// Which frame is being made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameInfo {
    /// Counts from 0.
    pub index: u64,
    /// Seed of everything random; equal seeds give equal pictures.
    pub seed: u32,
}

/// How fast a piece of work went, so that the next one can be cut to size. Keep one per kind of work in the pass.
#[derive(Clone, Copy, Debug, Default)]
pub struct WorkRate {
    units_per_second: Option<f64>,
}

/// Aim for the length of one submission. Drivers end work that holds the device for about two seconds; users like progress sooner.
const SUBMISSION_SECONDS: f64 = 0.1;

/// Receives how far the frame is: pass name and a fraction in [0, 1]. Returning `false` stops the frame.
pub type Progress<'a> = dyn FnMut(&str, f32) -> bool + 'a;

/// Command recording for one pass in one frame.
pub struct Frame<'a> {
    pub(crate) gpu: &'a Gpu,
    pub(crate) encoder: &'a mut wgpu::CommandEncoder,
    pub(crate) timer: &'a mut Timer,
    pub(crate) pass: &'a str,
    pub(crate) info: FrameInfo,
    pub(crate) history_valid: bool,
    pub(crate) progress: &'a mut Progress<'a>,
    pub(crate) connected: &'a Connected,
    /// Seconds that this pass waited for its own submissions.
    pub(crate) waited: f64,
}

impl<'a> Frame<'a> {
    /// Name of the pass in the file.
    pub fn pass_name(&self) -> &str {
        self.pass
    }

    /// Frame index and seed.
    pub fn info(&self) -> FrameInfo {
        self.info
    }

    /// Whether history inputs hold last frame's values. `false` in the first frame and after a reset; they are all zero then.
    pub fn history_is_valid(&self) -> bool {
        self.history_valid
    }

    /// The device.
    pub fn gpu(&self) -> &'a Gpu {
        self.gpu
    }

    /// Writes the start of a small buffer. The write happens before everything that is recorded since the last [`Frame::split`].
    pub fn write_buffer(&self, buffer: &wgpu::Buffer, bytes: &[u8]) {
        self.gpu.queue().write_buffer(buffer, 0, bytes);
    }

    /// For copies and clears. Draw and dispatch through [`Frame::render`] and [`Frame::compute`], which are timed.
    pub fn encoder(&mut self) -> &mut wgpu::CommandEncoder {
        self.encoder
    }

    /// Records a compute pass, labelled and timed.
    pub fn compute<T>(&mut self, label: &str, record: impl FnOnce(&mut wgpu::ComputePass<'_>) -> T) -> T {
        let query = self.timer.begin(self.pass, label, self.encoder);
        let mut pass = self.encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some(label),
            timestamp_writes: query.as_ref().and_then(|query| query.compute_writes()),
        });
        // Groups sit inside encoder passes: a group around several would have to be closed at every split, and some software drivers lose their
        // footing when labelled passes nest in one.
        pass.push_debug_group(self.pass);
        let result = record(&mut pass);
        pass.pop_debug_group();
        drop(pass);
        self.timer.end(query, self.encoder);
        result
    }

    /// Records a render pass, labelled and timed.
    pub fn render<T>(
        &mut self,
        label: &str,
        colors: &[Option<wgpu::RenderPassColorAttachment<'_>>],
        depth: Option<wgpu::RenderPassDepthStencilAttachment<'_>>,
        record: impl FnOnce(&mut wgpu::RenderPass<'_>) -> T,
    ) -> T {
        let query = self.timer.begin(self.pass, label, self.encoder);
        let mut pass = self.encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some(label),
            color_attachments: colors,
            depth_stencil_attachment: depth,
            timestamp_writes: query.as_ref().and_then(|query| query.render_writes()),
            ..Default::default()
        });
        // Groups sit inside encoder passes: a group around several would have to be closed at every split, and some software drivers lose their
        // footing when labelled passes nest in one.
        pass.push_debug_group(self.pass);
        let result = record(&mut pass);
        pass.pop_debug_group();
        drop(pass);
        self.timer.end(query, self.encoder);
        result
    }

    /// Submits what has been recorded so far and reports progress, so that long work reaches the device in pieces. Waits for the work, so that
    /// at most one piece is under way.
    pub fn split(&mut self, done: f32) -> Result<(), RunError> {
        let clock = Instant::now();
        self.submit();
        self.gpu.wait()?;
        self.waited += clock.elapsed().as_secs_f64();
        if (self.progress)(self.pass, done.clamp(0.0, 1.0)) { Ok(()) } else { Err(RunError::Stopped) }
    }

    fn submit(&mut self) {
        let device = self.gpu.device();
        let next = device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some(self.pass) });
        self.timer.resolve(self.encoder);
        let done = std::mem::replace(self.encoder, next);
        self.gpu.queue().submit([done.finish()]);
    }

    /// Does `total` units of work (say, virtual lights) in ranges, each its own submission of about a tenth of a second when the whole is longer than that.
    ///
    /// `record` is called with consecutive ranges that start at multiples of `granularity`. It may write buffers for each range. `rate` carries the
    /// measured speed from frame to frame: work that fits one submission is recorded in one range without waiting.
    pub fn ranges(
        &mut self,
        total: u32,
        granularity: u32,
        cost_per_unit: f64,
        rate: &mut WorkRate,
        mut record: impl FnMut(&mut Frame<'_>, Range<u32>) -> Result<(), RunError>,
    ) -> Result<(), RunError> {
        let granularity = granularity.max(1);
        let mut start = 0;
        // A first guess that is short on every device; what follows is measured.
        let mut speed = rate.units_per_second.unwrap_or(1e7);
        let measured = rate.units_per_second.is_some();
        if measured && f64::from(total) * cost_per_unit <= speed * SUBMISSION_SECONDS {
            return record(self, 0..total);
        }
        if f64::from(total) * cost_per_unit > speed * SUBMISSION_SECONDS {
            // What came before in this encoder must not be counted as this pass's.
            self.split(0.0)?;
        }
        while start < total {
            let fits = (speed * SUBMISSION_SECONDS / cost_per_unit.max(1e-9)).min(f64::from(u32::MAX)) as u32;
            let length = (fits / granularity * granularity).max(granularity);
            let end = start.saturating_add(length).min(total);
            let clock = Instant::now();
            record(self, start..end)?;
            if start == 0 && end == total {
                return Ok(());
            }
            self.split(end as f32 / total as f32)?;
            let seconds = clock.elapsed().as_secs_f64().max(1e-4);
            let now = f64::from(end - start) * cost_per_unit / seconds;
            // Grow at most fourfold: the first pieces are too small to time well.
            speed = now.clamp(speed / 4.0, speed * 4.0);
            start = end;
        }
        rate.units_per_second = Some(speed);
        Ok(())
    }

    /// A connected resource by its `pass.port` name, for passes that are generic over what they read (a debug view, a copy). Ports give the
    /// same without a look-up. Anything that this pass did not declare is refused.
    pub fn resource<R: Resource>(&self, name: &str) -> Result<R, RunError> {
        self.connected.resource(name).ok_or_else(|| RunError::Undeclared {
            pass: self.pass.to_owned(),
            resource: format!("{name}: {}", R::NAME),
            declared: self.connected.describe(),
        })
    }
}

/// What the ports of a pass are connected to, by `pass.port` name.
#[derive(Default)]
pub(crate) struct Connected {
    entries: Vec<(String, &'static str, Box<dyn AnyShape>, PartSet)>,
}

impl Connected {
    pub fn add(&mut self, name: &str, type_name: &'static str, shape: Box<dyn AnyShape>, parts: PartSet) {
        self.entries.push((name.to_owned(), type_name, shape, parts));
    }

    pub fn parts(&self, name: &str) -> Option<&PartSet> {
        self.entries.iter().find(|(entry, ..)| entry == name).map(|(.., parts)| parts)
    }

    fn resource<R: Resource>(&self, name: &str) -> Option<R> {
        let (_, _, shape, parts) = self.entries.iter().find(|(entry, type_name, ..)| entry == name && *type_name == R::NAME)?;
        Some(R::assemble(shape.as_ref().as_any().downcast_ref()?, parts))
    }

    fn describe(&self) -> String {
        if self.entries.is_empty() {
            return "none".into();
        }
        self.entries.iter().map(|(name, type_name, ..)| format!("{name}: {type_name}")).collect::<Vec<_>>().join(", ")
    }
}
