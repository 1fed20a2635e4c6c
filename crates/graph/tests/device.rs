//! The device half: pipelines, bindings, read-back, counting, and graphs that run. One process, one device.
#![allow(clippy::unwrap_used)]

mod common;

use lobelia_graph::{
    Access, BuildError, Gpu, GpuOptions, Part, Values,
    check::Checker,
    testing::{compare, evaluate, gpu},
};
use lobelia_shaders::{Flags, Source};

fn encoder(gpu: &Gpu) -> wgpu::CommandEncoder {
    gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor { label: None })
}

const DOUBLE: &str = "@group(0) @binding(0) var<storage, read> source: array<f32>;\n\
    @group(0) @binding(1) var<storage, read_write> doubled: array<f32>;\n\
    @group(0) @binding(2) var<uniform> unused: vec4f;\n\
    @compute @workgroup_size(64) fn double(@builtin(global_invocation_id) id: vec3u) { doubled[id.x] = 2.0 * source[id.x]; }\n";

#[test]
fn bindings_are_checked_by_name_kind_and_right() {
    let Some(gpu) = gpu() else { return };
    let pipeline = gpu.compute_pipeline("double", Source { path: "double.wgsl", text: DOUBLE }, "double", &Flags::new()).unwrap();
    let buffer = gpu.device().create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: 256,
        usage: wgpu::BufferUsages::STORAGE,
        mapped_at_creation: false,
    });
    let good = pipeline.bindings(0).raw_buffer("source", &buffer).raw_buffer("doubled", &buffer);
    // One buffer for reading and writing is refused by the device when it is used, not here; declared but unused variables may be given or not.
    good.raw_buffer("unused", &buffer).build(gpu).unwrap();
    let unknown = pipeline.bindings(0).raw_buffer("sauce", &buffer).build(gpu).unwrap_err();
    assert!(matches!(&unknown, BuildError::UnknownBinding { nearest: Some(near), .. } if near == "source"), "{unknown}");
    let missing = pipeline.bindings(0).raw_buffer("source", &buffer).build(gpu).unwrap_err();
    assert!(matches!(&missing, BuildError::MissingBinding { name, .. } if name == "doubled"), "{missing}");
    let sampler = gpu.device().create_sampler(&wgpu::SamplerDescriptor::default());
    let kind = pipeline.bindings(0).sampler("source", &sampler).build(gpu).unwrap_err();
    assert!(matches!(&kind, BuildError::BindingKind { .. }), "{kind}");
    let input = lobelia_graph::BufferPart::for_test(buffer.clone(), Access::Read, "lights.lights/lights");
    let writes = pipeline.bindings(0).raw_buffer("source", &buffer).buffer("doubled", &input).build(gpu).unwrap_err();
    assert!(writes.to_string().contains("`lights.lights/lights` came through an input port"), "{writes}");
}

#[test]
fn bad_shaders_and_entries_are_values() {
    let Some(gpu) = gpu() else { return };
    let entry = gpu.compute_pipeline("x", Source { path: "double.wgsl", text: DOUBLE }, "triple", &Flags::new()).unwrap_err();
    assert!(entry.to_string().contains("no entry point `triple`; it has double"), "{entry}");
    let syntax = gpu.compute_pipeline("x", Source { path: "bad.wgsl", text: "fn f( {" }, "f", &Flags::new()).unwrap_err();
    assert!(syntax.to_string().starts_with("bad.wgsl:1:"), "{syntax}");
}

#[test]
fn tables_are_evaluated_and_a_wrong_twin_is_found() {
    let Some(gpu) = gpu() else { return };
    let wgsl = "struct Input { x: f32, y: f32 }\nstruct Output { sum: f32 }\nfn evaluate(input: Input) -> Output { return Output(input.x + input.y * input.y); }";
    let inputs: Vec<[f32; 2]> = (0..100_000).map(|row| [row as f32, (row % 7) as f32]).collect();
    let got: Vec<f32> = evaluate(gpu, wgsl, &Flags::new(), &inputs).unwrap();
    let got: Vec<f64> = got.into_iter().map(f64::from).collect();
    let twin: Vec<f64> = inputs.iter().map(|[x, y]| f64::from(*x) + f64::from(*y).powi(2)).collect();
    compare(&twin, &got, 1e-6, 1e-6).unwrap();
    let wrong: Vec<f64> = inputs.iter().map(|[x, y]| f64::from(*x) + f64::from(*y)).collect();
    assert!(compare(&wrong, &got, 1e-6, 1e-6).is_err());
}

#[test]
fn the_comparator_rejects_what_it_must() {
    assert!(compare(&[1.0, 2.0], &[1.0, 2.0], 0.0, 1e-9).is_ok());
    for (expected, got) in
        [(vec![1.0], vec![f64::NAN]), (vec![f64::NAN], vec![f64::NAN]), (vec![1.0], vec![]), (vec![], vec![]), (vec![1.0], vec![1.1])]
    {
        assert!(compare(&expected, &got, 1e-3, 1e-3).is_err(), "{expected:?} {got:?}");
    }
}

/// Counts `words` as a buffer of `values`.
fn counted(gpu: &Gpu, words: &[u32], values: Values) -> (u64, u64) {
    let buffer = gpu.device().create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: (words.len() * 4) as u64,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    gpu.queue().write_buffer(&buffer, 0, bytemuck::cast_slice(words));
    let part = lobelia_graph::PartHandle::Buffer(lobelia_graph::BufferPart::for_test(buffer, Access::Write, "planted"));
    let mut checker = Checker::new(gpu).unwrap();
    let mut encoder = encoder(gpu);
    checker.count(gpu, &mut encoder, &part, values, "pass", "planted").unwrap();
    gpu.queue().submit([encoder.finish()]);
    let findings = checker.collect(gpu).unwrap();
    assert_eq!(findings.len(), 1);
    (findings[0].non_finite, findings[0].negative)
}

#[test]
fn planted_values_in_buffers_are_counted() {
    let Some(gpu) = gpu() else { return };
    let bits = |value: f32| value.to_bits();
    let planted = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, -0.0, 0.0, 1.0, f32::MIN_POSITIVE / 4.0, -1e-40, 3e38].map(bits);
    assert_eq!(counted(gpu, &planted, Values::NonNegative), (3, 2));
    assert_eq!(counted(gpu, &planted, Values::Finite), (3, 0));
    // In records of two words only the second is a float, and its sign matters.
    let records = [u32::MAX, bits(1.0), u32::MAX, bits(-1.0), u32::MAX, bits(f32::NAN)];
    assert_eq!(counted(gpu, &records, Values::Records { stride: 2, mask: 0b10, non_negative: 0b10 }), (1, 1));
    assert_eq!(counted(gpu, &records, Values::Records { stride: 2, mask: 0b11, non_negative: 0 }), (4, 0));
    // More words than invocations in one sweep.
    let mut many = vec![0u32; 300_000];
    many[299_999] = bits(f32::NAN);
    assert_eq!(counted(gpu, &many, Values::NonNegative), (1, 0));
}

#[test]
fn planted_values_in_textures_are_counted_and_poison_is_seen() {
    let Some(gpu) = gpu() else { return };
    let half = |value: f32| half::f16::from_f32(value).to_bits();
    // 5 texels wide: rows are padded in the copy, and the padding must not count.
    for (format, texel) in
        [(wgpu::TextureFormat::Rgba16Float, 8usize), (wgpu::TextureFormat::Rgba32Float, 16), (wgpu::TextureFormat::R32Float, 4)]
    {
        let part = Part::texture("image", format, [5, 3], wgpu::TextureUsages::STORAGE_BINDING).values(Values::NonNegative);
        let lobelia_graph::PartKind::Texture(shape) = &part.kind else { unreachable!() };
        let texture = gpu.device().create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width: 5, height: 3, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::COPY_SRC
                | wgpu::TextureUsages::COPY_DST
                | wgpu::TextureUsages::TEXTURE_BINDING
                | wgpu::TextureUsages::STORAGE_BINDING,
            view_formats: &[],
        });
        let handle = lobelia_graph::PartHandle::Texture(lobelia_graph::TexturePart::for_test(
            texture.clone(),
            shape.clone(),
            Access::Write,
            "planted",
        ));
        let mut checker = Checker::new(gpu).unwrap();
        let mut count = |poison: bool| {
            let mut encoder = encoder(gpu);
            if poison {
                checker.poison_texture(&mut encoder, &texture, shape);
            }
            checker.count(gpu, &mut encoder, &handle, Values::NonNegative, "pass", "image").unwrap();
            gpu.queue().submit([encoder.finish()]);
            let findings = checker.collect(gpu).unwrap();
            (findings[0].non_finite, findings[0].negative)
        };
        let channels = if format == wgpu::TextureFormat::R32Float { 1 } else { 4 };
        assert_eq!(count(true), (15 * channels, 0), "{format:?}: poison is NaN everywhere");
        // One NaN, one infinity, two negative colours, one negative zero; in four channels a negative alpha, which is allowed.
        let mut values = vec![1.0f32; 15 * channels as usize];
        (values[0], values[1], values[5], values[9], values[10]) = (f32::NAN, f32::INFINITY, -2.0, -1.0, -0.0);
        if channels == 4 {
            values[11] = -1.0;
        }
        let bytes: Vec<u8> = match format {
            wgpu::TextureFormat::Rgba16Float => values.iter().flat_map(|value| half(*value).to_le_bytes()).collect(),
            _ => values.iter().flat_map(|value| value.to_le_bytes()).collect(),
        };
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(5 * texel as u32), rows_per_image: Some(3) };
        gpu.queue().write_texture(
            texture.as_image_copy(),
            &bytes,
            layout,
            wgpu::Extent3d { width: 5, height: 3, depth_or_array_layers: 1 },
        );
        assert_eq!(count(false), (2, 2), "{format:?}");
        let back = gpu.read_texture(&texture, 0, 0).unwrap();
        assert_eq!(back.bytes, bytes, "{format:?} comes back as it went");
    }
}

#[test]
fn an_unknown_adapter_is_refused_by_name() {
    let refused = Gpu::new(&GpuOptions { adapter: Some("no such adapter".into()), baseline: true }).err().unwrap().to_string();
    assert!(refused.contains("`no such adapter`"), "{refused}");
}
