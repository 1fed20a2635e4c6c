//! The device: choosing an adapter, the pipeline cache, waiting, and turning the device's complaints into values.

use crate::{
    error::{BuildError, GpuError},
    pipeline::{Cache, ComputePipeline, RasterDescription, RasterPipeline},
};
use lobelia_shaders::{Composer, Flags, ShaderError, Source};
use std::{
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

/// Most bytes that one storage binding of any WebGPU device sees; what is larger is cut into pieces or refused.
pub const MAX_STORAGE_BINDING: u64 = 128 << 20;

/// Whole rows of `pitch` bytes that fit `most` bytes, one at least.
pub(crate) fn rows_within(most: u64, pitch: u32) -> u32 {
    u32::try_from(most / u64::from(pitch.max(1))).unwrap_or(u32::MAX).max(1)
}

/// Which device is wanted.
#[derive(Clone, Debug, Default)]
pub struct GpuOptions {
    /// Part of the adapter's name, any case. `None` reads `WGPU_ADAPTER_NAME`, else takes the best: discrete before integrated before software.
    pub adapter: Option<String>,
    /// No optional features, default limits: what every WebGPU device has.
    pub baseline: bool,
}

/// Pipelines made so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PipelineStatistics {
    /// Pipelines created.
    pub created: u64,
    /// Requests that the cache answered.
    pub cache_hits: u64,
    /// Seconds spent on composing shaders and creating pipelines.
    pub seconds: f64,
}

/// A device with its queue and its pipeline cache.
pub struct Gpu {
    device: wgpu::Device,
    queue: wgpu::Queue,
    info: Option<wgpu::AdapterInfo>,
    baseline: bool,
    errors: Arc<Mutex<Vec<GpuError>>>,
    cache: Mutex<Cache>,
}

/// Backends that compute correctly. Software GL returns zeros without a word, so GL is never asked for.
const BACKENDS: wgpu::Backends = wgpu::Backends::VULKAN.union(wgpu::Backends::METAL).union(wgpu::Backends::DX12);

/// Longest wait for the device before it is called lost.
const PATIENCE: Duration = Duration::from_secs(600);

pub(crate) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn instance() -> wgpu::Instance {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = BACKENDS;
    wgpu::Instance::new(descriptor)
}

/// Adapters, best first.
fn ranked(instance: &wgpu::Instance) -> Vec<wgpu::Adapter> {
    let mut adapters = pollster::block_on(instance.enumerate_adapters(BACKENDS));
    adapters.sort_by_key(|adapter| match adapter.get_info().device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Cpu => 3,
        wgpu::DeviceType::Other => 4,
    });
    adapters
}

impl Gpu {
    /// Opens a device.
    pub fn new(options: &GpuOptions) -> Result<Self, GpuError> {
        let wanted = options.adapter.clone().or_else(|| std::env::var("WGPU_ADAPTER_NAME").ok()).filter(|name| !name.is_empty());
        let fits = |adapter: &wgpu::Adapter| match &wanted {
            Some(name) => adapter.get_info().name.to_lowercase().contains(&name.to_lowercase()),
            None => true,
        };
        let adapter = ranked(&instance()).into_iter().find(fits).ok_or(GpuError::NoAdapter { wanted: wanted.clone() })?;
        let info = adapter.get_info();
        // These only make things measurable or labelled; nothing depends on them.
        let optional = wgpu::Features::TIMESTAMP_QUERY;
        let features = if options.baseline { wgpu::Features::empty() } else { adapter.features() & optional };
        let request = adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("lobelia"),
            required_features: features,
            required_limits: wgpu::Limits::default(),
            ..Default::default()
        });
        let (device, queue) =
            pollster::block_on(request).map_err(|error| GpuError::NoDevice { adapter: info.name.clone(), reason: error.to_string() })?;
        Ok(Self::assemble(device, queue, Some(info), options.baseline))
    }

    /// Uses a device that the host program has opened.
    pub fn from_device(device: wgpu::Device, queue: wgpu::Queue) -> Self {
        let baseline = device.features().is_empty();
        Self::assemble(device, queue, None, baseline)
    }

    fn assemble(device: wgpu::Device, queue: wgpu::Queue, info: Option<wgpu::AdapterInfo>, baseline: bool) -> Self {
        let errors: Arc<Mutex<Vec<GpuError>>> = Arc::default();
        let seen = errors.clone();
        device.on_uncaptured_error(Arc::new(move |error| {
            let error = match error {
                wgpu::Error::OutOfMemory { source } => GpuError::OutOfMemory(source.to_string()),
                wgpu::Error::Validation { description, .. } => GpuError::Validation(description),
                wgpu::Error::Internal { description, .. } => GpuError::Lost(description),
            };
            locked(&seen).push(error);
        }));
        let seen = errors.clone();
        device.set_device_lost_callback(move |reason, message| {
            if reason != wgpu::DeviceLostReason::Destroyed {
                locked(&seen).push(GpuError::Lost(message));
            }
        });
        Self { device, queue, info, baseline, errors, cache: Mutex::default() }
    }

    /// The adapters that could be used, best first.
    pub fn adapters() -> Vec<wgpu::AdapterInfo> {
        ranked(&instance()).iter().map(wgpu::Adapter::get_info).collect()
    }

    /// The device.
    pub fn device(&self) -> &wgpu::Device {
        &self.device
    }

    /// Its queue.
    pub fn queue(&self) -> &wgpu::Queue {
        &self.queue
    }

    /// What the adapter says of itself; `None` for a host's device.
    pub fn info(&self) -> Option<&wgpu::AdapterInfo> {
        self.info.as_ref()
    }

    /// Whether only the WebGPU baseline is used.
    pub fn is_baseline(&self) -> bool {
        self.baseline
    }

    /// Whether passes can be timed on the device.
    pub fn has_timestamps(&self) -> bool {
        self.device.features().contains(wgpu::Features::TIMESTAMP_QUERY)
    }

    /// The first complaint of the device since the last call.
    pub fn take_error(&self) -> Result<(), GpuError> {
        let mut errors = locked(&self.errors);
        if errors.is_empty() {
            return Ok(());
        }
        let first = errors.remove(0);
        // What follows a first error is mostly its echo.
        errors.clear();
        Err(first)
    }

    /// Waits until everything that was submitted is done.
    pub fn wait(&self) -> Result<(), GpuError> {
        let waited = self.device.poll(wgpu::PollType::Wait { submission_index: None, timeout: Some(PATIENCE) });
        self.take_error()?;
        waited.map(|_| ()).map_err(|error| GpuError::Lost(format!("it did not finish its work: {error}")))
    }

    /// Adds a WGSL module that entry files of passes may import.
    pub fn add_shader_module(&self, source: Source<'_>) -> Result<(), ShaderError> {
        locked(&self.cache).composer()?.add_module(source)
    }

    /// A compute pipeline, from the cache if it was made before.
    pub fn compute_pipeline(&self, label: &str, source: Source<'_>, entry: &str, flags: &Flags) -> Result<ComputePipeline, BuildError> {
        locked(&self.cache).compute(self, label, source, entry, flags)
    }

    /// A raster pipeline, from the cache if it was made before.
    pub fn raster_pipeline(&self, description: &RasterDescription<'_>) -> Result<RasterPipeline, BuildError> {
        locked(&self.cache).raster(self, description)
    }

    /// Pipelines made so far, and the time they took.
    pub fn pipeline_statistics(&self) -> PipelineStatistics {
        locked(&self.cache).statistics()
    }

    /// A composer as passes use it, for checks without pipelines.
    pub fn with_composer<T>(&self, use_it: impl FnOnce(&mut Composer) -> T) -> Result<T, ShaderError> {
        locked(&self.cache).composer().map(use_it)
    }
}
