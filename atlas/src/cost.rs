//! What each form of a lobe formula costs on a device: millions of evaluations in one dispatch, all forms in turn in the same run.

use lobelia_graph::{BuildError, Gpu, GpuError};
use lobelia_lobes::{asg, asg_product, averaged_direction, lobe_similarity, microfacet_lobe, sg, sg_cosine, sg_light};
use lobelia_shaders::{Flags, Source};
use std::{
    fmt::Write as _,
    time::{Duration, Instant},
};

/// Inputs of one evaluation, the same in Rust and WGSL.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// Sharpnesses or bandwidths, log-uniform in [1, 1e4].
    pub sharpness: [f64; 3],
    /// Cosine of an angle, uniform in [-1, 1].
    pub cosine: f64,
    /// Two unit directions; the second is in the upper hemisphere.
    pub axes: [glam::DVec3; 2],
}

/// One form of one operation.
pub struct Form {
    /// What is computed.
    pub operation: &'static str,
    /// Name of the function.
    pub function: &'static str,
    /// Its module in WGSL.
    pub module: &'static str,
    /// Arguments in WGSL, of an `at: Case`.
    pub arguments: &'static str,
    /// The form in `f64`.
    pub rust: fn(&Case) -> f64,
}

macro_rules! form {
    ($operation:literal, $module:literal, $function:ident, $arguments:literal, $path:path, |$case:ident| $rust:expr) => {
        Form {
            operation: $operation,
            function: stringify!($function),
            module: $module,
            arguments: $arguments,
            rust: |$case: &Case| {
                use $path as $function;
                $rust
            },
        }
    };
}

/// All forms that are compared, those of one operation together and the cheapest first.
pub fn forms() -> Vec<Form> {
    vec![
        form!("SG integral", "sg", sg_integral_fast, "at.sharpness.x", sg::sg_integral_fast, |case| sg_integral_fast(case.sharpness[0])),
        form!("SG integral", "sg", sg_integral, "at.sharpness.x", sg::sg_integral, |case| sg_integral(case.sharpness[0])),
        form!(
            "SG x SG integral",
            "sg",
            sg_product_integral_fast,
            "at.a, at.sharpness.x, at.b, at.sharpness.y",
            sg::sg_product_integral_fast,
            |case| sg_product_integral_fast(case.axes[0], case.sharpness[0], case.axes[1], case.sharpness[1])
        ),
        form!(
            "SG x SG integral",
            "sg",
            sg_product_integral,
            "at.a, at.sharpness.x, at.b, at.sharpness.y",
            sg::sg_product_integral,
            |case| sg_product_integral(case.axes[0], case.sharpness[0], case.axes[1], case.sharpness[1])
        ),
        form!(
            "SG over the hemisphere",
            "sg_cosine",
            hemisphere_integral_fast,
            "at.sharpness.x, at.cosine",
            sg_cosine::hemisphere_integral_fast,
            |case| hemisphere_integral_fast(case.sharpness[0], case.cosine)
        ),
        form!(
            "SG over the hemisphere",
            "sg_cosine",
            hemisphere_integral,
            "at.sharpness.x, at.cosine",
            sg_cosine::hemisphere_integral,
            |case| hemisphere_integral(case.sharpness[0], case.cosine)
        ),
        form!(
            "SG x clamped cosine",
            "sg_cosine",
            clamped_cosine_integral_constant_cosine,
            "at.sharpness.x, at.cosine",
            sg_cosine::clamped_cosine_integral_constant_cosine,
            |case| clamped_cosine_integral_constant_cosine(case.sharpness[0], case.cosine)
        ),
        form!(
            "SG x clamped cosine",
            "sg_cosine",
            clamped_cosine_integral_fast,
            "at.sharpness.x, at.cosine",
            sg_cosine::clamped_cosine_integral_fast,
            |case| clamped_cosine_integral_fast(case.sharpness[0], case.cosine)
        ),
        form!(
            "SG x clamped cosine",
            "sg_cosine",
            clamped_cosine_integral,
            "at.sharpness.x, at.cosine, 1.0 - at.cosine * at.cosine",
            sg_cosine::clamped_cosine_integral,
            |case| clamped_cosine_integral(case.sharpness[0], case.cosine, 1.0 - case.cosine * case.cosine)
        ),
        form!("ASG integral", "asg", asg_integral_fast, "at.sharpness.x, at.sharpness.y", asg::asg_integral_fast, |case| {
            asg_integral_fast(case.sharpness[0], case.sharpness[1])
        }),
        form!("ASG integral", "asg", asg_integral, "at.sharpness.x, at.sharpness.y", asg::asg_integral, |case| {
            asg_integral(case.sharpness[0], case.sharpness[1])
        }),
        form!(
            "ASG x SG integral",
            "asg",
            asg_sg_integral_printed,
            "at.sharpness.x, at.sharpness.y, at.b, at.sharpness.z",
            asg_product::asg_sg_integral_printed,
            |case| asg_sg_integral_printed(case.sharpness[0], case.sharpness[1], case.axes[1], case.sharpness[2])
        ),
        form!(
            "ASG x SG integral",
            "asg",
            asg_sg_integral,
            "at.sharpness.x, at.sharpness.y, at.b, at.sharpness.z",
            asg_product::asg_sg_integral,
            |case| asg_sg_integral(case.sharpness[0], case.sharpness[1], case.axes[1], case.sharpness[2])
        ),
        form!(
            "averaged direction",
            "averaged_direction",
            sharpness_from_averaged_direction_toksvig,
            "0.5 + 0.5 * at.cosine, 0.75 - at.cosine * (0.5 + 0.25 * at.cosine)",
            averaged_direction::sharpness_from_averaged_direction_toksvig,
            |case| sharpness_from_averaged_direction_toksvig(length(case), 1.0 - length(case).powi(2))
        ),
        form!(
            "averaged direction",
            "averaged_direction",
            sharpness_from_averaged_direction_banerjee,
            "0.5 + 0.5 * at.cosine, 0.75 - at.cosine * (0.5 + 0.25 * at.cosine)",
            averaged_direction::sharpness_from_averaged_direction_banerjee,
            |case| sharpness_from_averaged_direction_banerjee(length(case), 1.0 - length(case).powi(2))
        ),
        form!(
            "averaged direction",
            "averaged_direction",
            sharpness_from_averaged_direction,
            "0.5 + 0.5 * at.cosine, 0.75 - at.cosine * (0.5 + 0.25 * at.cosine)",
            averaged_direction::sharpness_from_averaged_direction,
            |case| sharpness_from_averaged_direction(length(case), 1.0 - length(case).powi(2))
        ),
        form!(
            "similarity of lobes",
            "lobe_similarity",
            lobe_similarity,
            "at.a, at.sharpness.x, at.b, at.sharpness.y",
            lobe_similarity::lobe_similarity,
            |case| lobe_similarity(case.axes[0], case.sharpness[0], case.axes[1], case.sharpness[1])
        ),
        form!(
            "similarity of lobes",
            "lobe_similarity",
            lobe_similarity_exact,
            "at.a, at.sharpness.x, at.b, at.sharpness.y",
            lobe_similarity::lobe_similarity_exact,
            |case| lobe_similarity_exact(case.axes[0], case.sharpness[0], case.axes[1], case.sharpness[1])
        ),
        form!(
            "virtual SG light's kernel",
            "sg_light",
            vsgl_kernel_fast,
            "at.sharpness.xy, at.a, at.sharpness.z, at.b, 1.0, abs(at.cosine)",
            sg_light::vsgl_kernel_fast,
            |case| vsgl_kernel_fast(
                [case.sharpness[0], case.sharpness[1]],
                case.axes[0],
                case.sharpness[2],
                case.axes[1],
                1.0,
                case.cosine.abs()
            )
        ),
        form!(
            "virtual SG light's kernel",
            "sg_light",
            vsgl_kernel,
            "at.sharpness.xy, at.a, at.sharpness.z, at.b, 1.0, abs(at.cosine)",
            sg_light::vsgl_kernel,
            |case| vsgl_kernel(
                [case.sharpness[0], case.sharpness[1]],
                case.axes[0],
                case.sharpness[2],
                case.axes[1],
                1.0,
                case.cosine.abs()
            )
        ),
        form!(
            "glossy shading by an SG light",
            "microfacet_lobe",
            glossy_sg_light_fast,
            "abs(at.cosine) + 0.01, vec3f(0.0, 0.0, 1.0), at.b, at.a, at.sharpness.x",
            microfacet_lobe::glossy_sg_light_fast,
            |case| glossy_sg_light_fast(alpha(case), glam::DVec3::Z, case.axes[1], case.axes[0], case.sharpness[0])
        ),
        form!(
            "glossy shading by an SG light",
            "microfacet_lobe",
            glossy_sg_light_one,
            "abs(at.cosine) + 0.01, vec3f(0.0, 0.0, 1.0), at.b, at.a, at.sharpness.x",
            microfacet_lobe::glossy_sg_light_one,
            |case| glossy_sg_light_one(alpha(case), glam::DVec3::Z, case.axes[1], case.axes[0], case.sharpness[0])
        ),
        form!(
            "glossy shading by an SG light",
            "microfacet_lobe",
            glossy_sg_light_two,
            "abs(at.cosine) + 0.01, vec3f(0.0, 0.0, 1.0), at.b, at.a, at.sharpness.x",
            microfacet_lobe::glossy_sg_light_two,
            |case| glossy_sg_light_two(alpha(case), glam::DVec3::Z, case.axes[1], case.axes[0], case.sharpness[0])
        ),
        form!(
            "glossy shading by an SG light",
            "microfacet_lobe",
            glossy_sg_light_three,
            "abs(at.cosine) + 0.01, vec3f(0.0, 0.0, 1.0), at.b, at.a, at.sharpness.x",
            microfacet_lobe::glossy_sg_light_three,
            |case| glossy_sg_light_three(alpha(case), glam::DVec3::Z, case.axes[1], case.axes[0], case.sharpness[0])
        ),
        form!(
            "glossy shading by an SG light",
            "microfacet_lobe",
            filtered_ndf_shading,
            "abs(at.cosine) + 0.01, vec3f(0.0, 0.0, 1.0), at.b, at.a, at.sharpness.x",
            microfacet_lobe::filtered_ndf_shading,
            |case| filtered_ndf_shading(alpha(case), glam::DVec3::Z, case.axes[1], case.axes[0], case.sharpness[0])
        ),
    ]
}

/// Length of an averaged direction.
fn length(case: &Case) -> f64 {
    0.5 + 0.5 * case.cosine
}

fn alpha(case: &Case) -> f64 {
    (case.cosine.abs() + 0.01).min(1.0)
}

/// A table of cases for timing in Rust, and the generator that the shader uses.
pub fn cases(count: u32) -> Vec<Case> {
    (0..count)
        .map(|index| {
            let mut draw = crate::draw::Draw::new(index, 90);
            let sharpness = [(); 3].map(|()| 10f64.powf(4.0 * draw.unit()));
            let cosine = draw.between(-1.0, 1.0);
            let mut direction = |low: f64| {
                let z = draw.between(low, 1.0);
                let azimuth = draw.between(0.0, std::f64::consts::TAU);
                let s = (1.0 - z * z).sqrt();
                glam::DVec3::new(s * azimuth.cos(), s * azimuth.sin(), z)
            };
            Case { sharpness, cosine, axes: [direction(-1.0), direction(0.0)] }
        })
        .collect()
}

const CASE: &str = "
struct Case { sharpness: vec3f, cosine: f32, a: vec3f, b: vec3f }
fn direction(u: vec2f, low: f32) -> vec3f {
    // Any spread will do that costs little: a point of a cube, made a unit vector.
    let p = vec3f(2.0 * u - 1.0, mix(low, 1.0, fract(u.x * 7.0 + u.y * 3.0)) + 1e-3);
    return p * inverseSqrt(dot(p, p));
}
fn draw(index: u32) -> Case {
    let u = vec4f(unit_float(hash(index)), unit_float(hash(index ^ 0x68bc21ebu)), unit_float(hash(index ^ 0x02e5be93u)), unit_float(hash(index ^ 0x967a889bu)));
    return Case(exp2(13.3 * u.xyz), 2.0 * u.w - 1.0, direction(u.xy, -1.0), direction(u.zw, 0.0));
}
";

/// Invocations of a dispatch, and evaluations of each.
const INVOCATIONS: u32 = 1 << 16;
const EVALUATIONS: u32 = 64;

/// Nanoseconds per evaluation of each form on the device, without what drawing the inputs costs. Medians of `rounds`, forms in turn within each.
///
/// Throughput, not latency: the time of a dispatch of four million evaluations over their number.
pub fn measure(gpu: &Gpu, forms: &[Form], rounds: usize) -> Result<Vec<f64>, MeasureError> {
    let sums = gpu.device().create_buffer(&wgpu::BufferDescriptor {
        label: Some("sums"),
        size: u64::from(INVOCATIONS) * 4,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    let baseline =
        ("#import lobelia::sampling::{hash, unit_float}".to_owned(), "at.sharpness.x + at.sharpness.y + at.sharpness.z".to_owned());
    let texts = forms.iter().map(|form| {
        let imports = format!("{}\n#import lobelia::{}::{}", baseline.0, form.module, form.function);
        (imports, format!("{} + {}({})", baseline.1, form.function, form.arguments))
    });
    let mut work = Vec::new();
    for (imports, value) in std::iter::once(baseline.clone()).chain(texts) {
        let text = format!(
            "{imports}\n{CASE}\n@group(0) @binding(0) var<storage, read_write> sums: array<f32>;\n\
             @compute @workgroup_size(64) fn run(@builtin(global_invocation_id) id: vec3u) {{\n\
             var sum = 0.0;\n\
             for (var k = 0u; k < {EVALUATIONS}u; k++) {{\n\
             let at = draw(id.x * {EVALUATIONS}u + k);\n\
             sum += {value} + at.cosine + at.a.x + at.b.y;\n}}\n\
             sums[id.x] = sum;\n}}\n"
        );
        let pipeline = gpu.compute_pipeline("cost", Source { path: "cost.wgsl", text: &text }, "run", &Flags::new())?;
        let group = pipeline.bindings(0).raw_buffer("sums", &sums).build(gpu)?;
        work.push((pipeline, group));
    }
    let mut times = vec![Vec::new(); work.len()];
    for round in 0..=rounds {
        for (times, (pipeline, group)) in times.iter_mut().zip(&work) {
            let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("cost") });
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some("cost"), timestamp_writes: None });
            pass.set_pipeline(pipeline.raw());
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups(INVOCATIONS / 64, 1, 1);
            drop(pass);
            let clock = Instant::now();
            gpu.queue().submit([encoder.finish()]);
            // Reading a result back is the one way to wait that no driver cuts short.
            gpu.read_buffer(&sums)?;
            // The first round compiles.
            if round > 0 {
                times.push(clock.elapsed());
            }
        }
    }
    let median = |times: &mut Vec<Duration>| {
        times.sort_unstable();
        times[times.len() / 2].as_secs_f64() * 1e9 / f64::from(INVOCATIONS * EVALUATIONS)
    };
    let medians: Vec<f64> = times.iter_mut().map(median).collect();
    Ok(medians[1..].iter().map(|time| (time - medians[0]).max(0.0)).collect())
}

/// Why costs could not be measured.
#[derive(Debug, thiserror::Error)]
pub enum MeasureError {
    /// A shader that does not compose or compile.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// A device that was lost.
    #[error(transparent)]
    Gpu(#[from] GpuError),
}

/// Nanoseconds per evaluation that cannot be told from nothing.
const NOISE: f64 = 0.05;

/// A Markdown table of nanoseconds per evaluation, on the device and in Rust, with the ratio to the cheapest form of each operation.
pub fn cost_table(forms: &[Form], device: &[f64], rust: &[f64]) -> String {
    let mut table = String::from("| operation | form | device, ns | ratio | Rust f64, ns |\n|---|---|---:|---:|---:|\n");
    let mut first = 0;
    for (index, form) in forms.iter().enumerate() {
        if form.operation != forms[first].operation {
            first = index;
        }
        // Writing to a string cannot fail.
        let _ = writeln!(
            table,
            "| {} | `{}` | {} | {} | {:.1} |",
            if first == index { form.operation } else { "" },
            form.function,
            if device[index] < NOISE { format!("below {NOISE}") } else { format!("{:.2}", device[index]) },
            if device[first] < NOISE { "-".to_owned() } else { format!("{:.1}", device[index] / device[first]) },
            rust[index]
        );
    }
    table
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn every_form_runs_on_the_device_and_in_rust() {
        let forms = forms();
        for case in cases(64) {
            assert!(forms.iter().all(|form| (form.rust)(&case).is_finite()), "{case:?}");
        }
        let Some(gpu) = lobelia_graph::testing::gpu() else { return };
        let costs = measure(gpu, &forms, 1).unwrap();
        assert_eq!(costs.len(), forms.len());
        assert!(costs.iter().all(|cost| cost.is_finite()));
        println!("{}", cost_table(&forms, &costs, &vec![0.0; forms.len()]));
    }
}
