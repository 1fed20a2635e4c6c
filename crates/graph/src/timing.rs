//! Device time per encoder pass, by timestamp queries at pass edges, and traces of it.
//!
//! Timestamps inside a pass are never asked for: software drivers resolve them at the wrong moment.

use crate::{gpu::Gpu, run::FrameReport};
use std::path::Path;
use wgpu_profiler::{GpuProfiler, GpuProfilerQuery, GpuProfilerSettings, GpuTimerQueryResult};

/// One timed encoder pass.
#[derive(Clone, Debug, PartialEq)]
pub struct Span {
    /// Name of the graph's pass.
    pub pass: String,
    /// Label of the encoder pass.
    pub label: String,
    /// Milliseconds since the frame's first timestamp.
    pub start_ms: f64,
    /// As `start_ms`.
    pub end_ms: f64,
}

/// The device's spans of one frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameTimes {
    /// In the order of recording.
    pub spans: Vec<Span>,
}

/// A query that is open.
pub struct Query(GpuProfilerQuery);

impl Query {
    /// Where a compute pass writes its edges.
    pub fn compute_writes(&self) -> Option<wgpu::ComputePassTimestampWrites<'_>> {
        self.0.compute_pass_timestamp_writes()
    }

    /// Where a render pass writes its edges.
    pub fn render_writes(&self) -> Option<wgpu::RenderPassTimestampWrites<'_>> {
        self.0.render_pass_timestamp_writes()
    }
}

/// Separates the graph's pass from the encoder pass in a query's label; no name holds it.
const SEPARATOR: char = '\u{1f}';

/// Takes the device's time, if it can and should.
pub struct Timer {
    profiler: Option<GpuProfiler>,
}

impl Timer {
    /// A timer; `enabled` has no effect on devices without timestamps.
    pub fn new(gpu: &Gpu, enabled: bool) -> Self {
        let settings = GpuProfilerSettings { enable_timer_queries: true, enable_debug_groups: false, max_num_pending_frames: 4 };
        let profiler = (enabled && gpu.has_timestamps()).then(|| GpuProfiler::new(gpu.device(), settings).ok()).flatten();
        Self { profiler }
    }

    /// Opens a query for the next encoder pass.
    pub fn begin(&mut self, pass: &str, label: &str, encoder: &mut wgpu::CommandEncoder) -> Option<Query> {
        let profiler = self.profiler.as_ref()?;
        Some(Query(profiler.begin_pass_query(format!("{pass}{SEPARATOR}{label}"), encoder)))
    }

    /// Closes it after the encoder pass ended.
    pub fn end(&mut self, query: Option<Query>, encoder: &mut wgpu::CommandEncoder) {
        if let (Some(profiler), Some(query)) = (&self.profiler, query) {
            profiler.end_query(encoder, query.0);
        }
    }

    /// Must be recorded last in every encoder that holds queries.
    pub fn resolve(&mut self, encoder: &mut wgpu::CommandEncoder) {
        if let Some(profiler) = &mut self.profiler {
            profiler.resolve_queries(encoder);
        }
    }

    /// After the frame's last submission.
    pub fn end_frame(&mut self) {
        if let Some(profiler) = &mut self.profiler
            && let Err(error) = profiler.end_frame()
        {
            tracing::warn!("device times of a frame are lost: {error}");
        }
    }

    /// The oldest finished frame, once its work is done.
    pub fn finished(&mut self, gpu: &Gpu) -> Option<FrameTimes> {
        let results = self.profiler.as_mut()?.process_finished_frame(gpu.queue().get_timestamp_period())?;
        let timed: Vec<(&GpuTimerQueryResult, std::ops::Range<f64>)> =
            results.iter().filter_map(|result| Some((result, result.time.clone()?))).collect();
        let origin = timed.iter().map(|(_, time)| time.start).fold(f64::INFINITY, f64::min);
        let span = |(result, time): (&GpuTimerQueryResult, std::ops::Range<f64>)| {
            let (pass, label) = result.label.split_once(SEPARATOR).unwrap_or(("", &result.label));
            Span { pass: pass.into(), label: label.into(), start_ms: (time.start - origin) * 1e3, end_ms: (time.end - origin) * 1e3 }
        };
        Some(FrameTimes { spans: timed.into_iter().map(span).collect() })
    }
}

/// Writes frames as a Chrome trace, which Perfetto opens: one track for recording on the CPU, one for the device. Frames follow each other without
/// gaps; CPU and device clocks are not the same, so each track counts from its own frame's start.
pub fn write_chrome_trace(path: &Path, frames: &[FrameReport]) -> std::io::Result<()> {
    let mut events = Vec::new();
    for (thread, name) in [(1, "CPU: recording"), (2, "device")] {
        events.push(serde_json::json!({"ph": "M", "pid": 1, "tid": thread, "name": "thread_name", "args": {"name": name}}));
    }
    let mut offset = 0.0;
    for (index, frame) in frames.iter().enumerate() {
        let mut end: f64 = 0.0;
        let mut event = |thread: u32, name: &str, category: &str, start: f64, length: f64| {
            end = end.max(start + length);
            events.push(serde_json::json!({
                "ph": "X", "pid": 1, "tid": thread, "name": name, "cat": category,
                "ts": (offset + start) * 1e3, "dur": length.max(0.0) * 1e3, "args": {"frame": index},
            }));
        };
        for (pass, start, length) in &frame.cpu_spans {
            event(1, pass, "record", *start, *length);
        }
        match &frame.spans {
            Some(times) => {
                for span in &times.spans {
                    event(2, &format!("{}: {}", span.pass, span.label), &span.pass, span.start_ms, span.end_ms - span.start_ms);
                }
            }
            None => {
                // Isolated passes: the wall clock, from when recording began.
                for (time, (_, start, _)) in frame.passes.iter().zip(&frame.cpu_spans) {
                    if let Some(length) = time.gpu_ms {
                        event(2, &time.pass, &time.pass, *start, length);
                    }
                }
            }
        }
        offset += end;
    }
    let text = serde_json::to_vec(&serde_json::json!({"displayTimeUnit": "ms", "traceEvents": events}))?;
    lobelia_base::replace_file(path, |file| std::io::Write::write_all(file, &text).map_err(|error| error.to_string()))
        .map_err(std::io::Error::other)
}
