//! For device tests, in this workspace and in that of anybody who writes a pass: one device per process, WGSL functions evaluated over tables, and a
//! comparator that no NaN gets past.

use crate::{
    error::BuildError,
    gpu::{Gpu, GpuOptions},
};
use lobelia_shaders::{Flags, Source};
use std::sync::OnceLock;

/// The device of this test process, at the WebGPU baseline; `LOBELIA_OPTIONAL_FEATURES=1` allows optional features.
///
/// Without an adapter it says on standard error that the test was skipped and returns `None`.
///
/// # Panics
/// Without an adapter when `LOBELIA_REQUIRE_GPU` is set (and is neither empty nor `0`), as CI sets it: a skipped test must not pass for a green one.
pub fn gpu() -> Option<&'static Gpu> {
    static GPU: OnceLock<Option<Gpu>> = OnceLock::new();
    let on = |name: &str| std::env::var(name).is_ok_and(|value| !value.is_empty() && value != "0");
    let opened = GPU.get_or_init(|| {
        let options = GpuOptions { adapter: None, baseline: !on("LOBELIA_OPTIONAL_FEATURES") };
        Gpu::new(&options).map_err(|error| eprintln!("skipped: {error}")).ok()
    });
    assert!(opened.is_some() || !on("LOBELIA_REQUIRE_GPU"), "LOBELIA_REQUIRE_GPU is set, but no device could be opened");
    if opened.is_none() {
        eprintln!("skipped: this test needs a Vulkan, Metal or DX12 device");
    }
    opened.as_ref()
}

/// Rows per dispatch: 64 invocations a group, 65535 groups at most.
const ROWS: usize = 1 << 20;

/// Evaluates one WGSL function over a table on the device.
///
/// `wgsl` holds imports and defines `struct Input`, `struct Output` and `fn evaluate(input: Input) -> Output`; the structs must have the layout of `I`
/// and `O` (32-bit fields; no `vec3` unless padded).
pub fn evaluate<I: bytemuck::Pod, O: bytemuck::Pod>(gpu: &Gpu, wgsl: &str, flags: &Flags, inputs: &[I]) -> Result<Vec<O>, BuildError> {
    let text = format!(
        "{wgsl}\n\
         @group(0) @binding(0) var<storage, read> inputs: array<Input>;\n\
         @group(0) @binding(1) var<storage, read_write> outputs: array<Output>;\n\
         @compute @workgroup_size(64) fn evaluate_table(@builtin(global_invocation_id) id: vec3u) {{\n\
         if id.x < arrayLength(&inputs) {{ outputs[id.x] = evaluate(inputs[id.x]); }}\n}}\n"
    );
    let pipeline = gpu.compute_pipeline("evaluate table", Source { path: "table.wgsl", text: &text }, "evaluate_table", flags)?;
    let mut outputs = Vec::with_capacity(inputs.len());
    for rows in inputs.chunks(ROWS) {
        let buffer = |size: usize, usage| {
            gpu.device().create_buffer(&wgpu::BufferDescriptor {
                label: Some("table"),
                size: size as u64,
                usage,
                mapped_at_creation: false,
            })
        };
        let input = buffer(std::mem::size_of_val(rows), wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST);
        let output = buffer(rows.len() * size_of::<O>(), wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);
        gpu.queue().write_buffer(&input, 0, bytemuck::cast_slice(rows));
        let group = pipeline.bindings(0).raw_buffer("inputs", &input).raw_buffer("outputs", &output).build(gpu)?;
        let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("table") });
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some("table"), timestamp_writes: None });
        pass.set_pipeline(pipeline.raw());
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups((rows.len() as u32).div_ceil(64), 1, 1);
        drop(pass);
        gpu.queue().submit([encoder.finish()]);
        outputs.extend(bytemuck::pod_collect_to_vec::<u8, O>(&gpu.read_buffer(&output)?));
    }
    Ok(outputs)
}

/// Compares two tables row by row: `|got - expected| <= absolute + relative |expected|`. NaN never passes, nor does an empty or a shorter table.
pub fn compare(expected: &[f64], got: &[f64], relative: f64, absolute: f64) -> Result<(), String> {
    if expected.is_empty() || expected.len() != got.len() {
        return Err(format!("{} rows were expected, {} came", expected.len(), got.len()));
    }
    let excess = |(expected, got): (&f64, &f64)| {
        let over = (got - expected).abs() / (absolute + relative * expected.abs());
        if over.is_nan() { f64::INFINITY } else { over }
    };
    let worst = expected.iter().zip(got).map(excess).enumerate().max_by(|left, right| left.1.total_cmp(&right.1));
    match worst {
        Some((row, over)) if over > 1.0 => {
            Err(format!("row {row}: expected {:e}, got {:e}, {over:.1} times what is allowed", expected[row], got[row]))
        }
        _ => Ok(()),
    }
}
