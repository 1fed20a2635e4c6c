//! `compose` against sums in 64-bit floats.

use crate::{
    EXTENT, draw,
    source::{Pattern, radiance},
    turn,
};
use lobelia_graph::{
    TextureData,
    testing::{compare, gpu},
};
use lobelia_shaders::{Flags, Source};
use wgpu::util::DeviceExt as _;

fn graph(pattern: &str, terms: u32) -> String {
    let sources: String = (0..terms).map(|seed| format!(r#""s{seed}": source(pattern: {pattern}, seed: {seed}), "#)).collect();
    format!(r#"(passes: {{{sources}"sum": compose()}}, output: "sum.radiance")"#)
}

/// Channel by channel, cut off where half floats end.
fn sum(pattern: Pattern, terms: u32) -> Vec<f64> {
    let mut total = vec![0.0; 3 * (EXTENT[0] * EXTENT[1]) as usize];
    for seed in 0..terms {
        let values = radiance(pattern, seed, EXTENT).into_iter().flatten();
        total.iter_mut().zip(values).for_each(|(total, value)| *total += f64::from(value));
    }
    total.into_iter().map(|value| value.min(65504.0)).collect()
}

fn channels(image: &TextureData) -> Vec<f64> {
    image.to_f32_rgba().iter().flat_map(|[r, g, b, _]| [*r, *g, *b]).map(f64::from).collect()
}

/// One unit in the last place of a half float for each rounding, whichever way the device rounds; below 6.1e-5 that unit is 6e-8.
fn agrees(expected: &[f64], got: &[f64], roundings: u32) -> Result<(), String> {
    compare(expected, got, f64::from(roundings) / 1024.0, f64::from(roundings) * 6e-8)
}

#[test]
fn any_number_of_terms_is_summed() {
    let Some(gpu) = gpu() else { return };
    // Around one, two and three stages.
    for (terms, roundings) in [(0, 1), (1, 1), (2, 1), (7, 1), (8, 1), (9, 2), (15, 2), (16, 3), (23, 4)] {
        let image = draw(gpu, &graph("dim", terms));
        assert!(image.to_f32_rgba().iter().all(|texel| texel[3] == 1.0), "{terms} terms: alpha");
        let got = channels(&image);
        agrees(&sum(Pattern::Dim, terms), &got, roundings).unwrap_or_else(|worst| panic!("{terms} terms: {worst}"));
        agrees(&sum(Pattern::Dim, terms + 1), &got, roundings).expect_err("a missing term must be seen");
    }
}

/// Zeros, subnormals and 65504 among them: finite and never negative, which the safety net counts.
#[test]
fn extremes_are_summed_and_cut_off() {
    let Some(gpu) = gpu() else { return };
    for (terms, roundings) in [(1, 1), (3, 1), (8, 1), (17, 3)] {
        let (expected, got) = (sum(Pattern::Random, terms), channels(&draw(gpu, &graph("random", terms))));
        agrees(&expected, &got, roundings).unwrap_or_else(|worst| panic!("{terms} terms: {worst}"));
        let cut = expected.iter().filter(|value| **value == 65504.0).count();
        assert!(cut > 100, "{terms} terms reach the largest half float {cut} times");
    }
}

#[test]
fn a_single_term_is_copied_bit_for_bit() {
    let Some(gpu) = gpu() else { return };
    assert_eq!(channels(&draw(gpu, &graph("grey", 1))), sum(Pattern::Grey, 1));
}

/// Some devices store what exceeds half floats as 65504, others as infinity, and only the shader's own cut-off makes them agree. To see it on either
/// kind, the shader writes 32-bit floats here.
#[test]
fn the_shader_itself_cuts_off() {
    let Some(gpu) = gpu() else { return };
    let _turn = turn();
    let text = include_str!("../../src/compose.wgsl").replace("rgba16float", "rgba32float");
    assert!(text.contains("rgba32float"));
    let flags = Flags::new().with("TERMS", 2u32);
    let pipeline = gpu.compute_pipeline("sum", Source { path: "compose.wgsl", text: &text }, "sum", &flags).unwrap();
    let size = wgpu::Extent3d { width: 32, height: 32, depth_or_array_layers: 1 };
    let description = |format, usage| wgpu::TextureDescriptor {
        label: None,
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    };
    let terms = [0, 1].map(|seed| radiance(Pattern::Random, seed, [32, 32]));
    let views = terms.each_ref().map(|term| {
        let texels: Vec<[half::f16; 4]> = term.iter().map(|[r, g, b]| [*r, *g, *b, 1.0].map(half::f16::from_f32)).collect();
        let bytes: Vec<u8> = texels.as_flattened().iter().flat_map(|value| value.to_le_bytes()).collect();
        let description = description(wgpu::TextureFormat::Rgba16Float, wgpu::TextureUsages::TEXTURE_BINDING);
        let texture = gpu.device().create_texture_with_data(gpu.queue(), &description, wgpu::util::TextureDataOrder::LayerMajor, &bytes);
        texture.create_view(&wgpu::TextureViewDescriptor::default())
    });
    let usage = wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_SRC;
    let output = gpu.device().create_texture(&description(wgpu::TextureFormat::Rgba32Float, usage));
    let view = output.create_view(&wgpu::TextureViewDescriptor::default());
    let group = pipeline.bindings(0).view("term_a", &views[0]).view("term_b", &views[1]).view("radiance", &view).build(gpu).unwrap();
    let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
    pass.set_pipeline(pipeline.raw());
    pass.set_bind_group(0, &group, &[]);
    let [x, y] = pipeline.workgroups_2d([32, 32]);
    pass.dispatch_workgroups(x, y, 1);
    drop(pass);
    gpu.queue().submit([encoder.finish()]);
    let added: Vec<f64> = terms[0].as_flattened().iter().zip(terms[1].as_flattened()).map(|(a, b)| f64::from(*a) + f64::from(*b)).collect();
    let cut: Vec<f64> = added.iter().map(|value| value.min(65504.0)).collect();
    let got = channels(&gpu.read_texture(&output, 0, 0).unwrap());
    compare(&cut, &got, 1e-6, 1e-12).unwrap();
    compare(&added, &got, 1e-6, 1e-12).expect_err("a sum that is not cut off must be seen");
}
