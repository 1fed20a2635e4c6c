//! Every shared WGSL function on the device against its twin in `f64`, over the whole domain, extremes included. One process, one device.
#![allow(clippy::unwrap_used)]

use glam::{DVec3, Vec3};
use lobelia::{
    graph::testing::{compare, evaluate, gpu},
    lobes::{
        brdf::{Brdf, Distribution},
        light::spot_falloff,
        octahedral::{octahedral_decode, octahedral_encode},
        sampling::{hash, r2_point, radical_inverse, unit_float},
        tonemap::{aces, agx, srgb_encode},
    },
    shaders::Flags,
};

/// Unit directions about +Z: cosine and azimuth from two numbers in [0, 1), with grazing and polar ones among them.
fn direction(u: f64, v: f64) -> DVec3 {
    // Cosines crowd towards both ends, where trouble lives.
    let cosine = (0.5 - 0.5 * (std::f64::consts::PI * u).cos()).clamp(1e-6, 1.0);
    let (sine, azimuth) = ((1.0 - cosine * cosine).max(0.0).sqrt(), std::f64::consts::TAU * v);
    DVec3::new(sine * azimuth.cos(), sine * azimuth.sin(), cosine)
}

/// The twin sees what the device sees: numbers rounded to 32 bits.
fn rounded(v: DVec3) -> (Vec3, DVec3) {
    (v.as_vec3(), v.as_vec3().as_dvec3())
}

const BRDF: &str = "#import lobelia::brdf::{Brdf, evaluate_brdf}
struct Input { l: vec4f, v: vec4f, n: vec4f, normal: vec4f, diffuse: vec4f }
struct Output { f: vec4f }
fn evaluate(input: Input) -> Output {
    let brdf = Brdf(input.diffuse.xyz, input.normal.xyz, input.normal.w, input.diffuse.w);
    return Output(vec4f(evaluate_brdf(brdf, input.n.xyz, input.n.xyz, input.l.xyz, input.v.xyz), 0.0));
}";

#[test]
fn brdf_twins() {
    let Some(gpu) = gpu() else { return };
    for (distribution, phong) in [(Distribution::Ggx, false), (Distribution::Phong, true)] {
        let (mut rows, mut twins) = (Vec::new(), Vec::new());
        for index in 0..100_000u32 {
            let [a, b] = r2_point(index, 1);
            let [c, d] = r2_point(index, 2);
            let [roughness, metallic] = r2_point(index, 3);
            // Half of the view directions are near the mirror of the light, where sharp lobes are.
            let l = direction(a, b);
            let mirror = DVec3::new(-l.x, -l.y, l.z);
            let v =
                if index % 2 == 0 { direction(c, d) } else { (mirror + (direction(c, d) - DVec3::Z) * 10f64.powf(-4.0 * c)).normalize() };
            let roughness = if index % 3 == 0 { 0.0 } else { roughness };
            let brdf = Brdf::new(DVec3::new(0.9, 0.5, 0.1), metallic, roughness, 1.0, distribution);
            let ((l32, l), (v32, v), (n32, n)) = (rounded(l), rounded(v), rounded(DVec3::Z));
            let (alpha, diffuse, normal) = (brdf.alpha as f32, rounded(brdf.diffuse), rounded(brdf.reflectance_normal));
            let seen = Brdf { alpha: f64::from(alpha), diffuse: diffuse.1, reflectance_normal: normal.1, ..brdf };
            // A half vector in 32 bits is off by 2^-23; at this alpha that moves the lobe by less than the tolerance below.
            rows.push(
                [l32.extend(0.0), v32.extend(0.0), n32.extend(0.0), normal.0.extend(1.0), diffuse.0.extend(alpha)]
                    .map(|row| row.to_array()),
            );
            twins.push(seen.evaluate(n, l, v));
        }
        let flags = Flags::new().with("SPECULAR", true).with("NDF_PHONG", phong);
        let found: Vec<[f32; 4]> = evaluate(gpu, BRDF, &flags, &rows).unwrap();
        let (mut expected, mut got) = (Vec::new(), Vec::new());
        for (twin, value) in twins.iter().zip(&found) {
            assert!(value.iter().all(|channel| channel.is_finite() && *channel >= 0.0), "{value:?}");
            expected.extend(twin.to_array());
            got.extend([value[0], value[1], value[2]].map(f64::from));
        }
        // At alpha 0.001 an angle error of 1e-7 rad is 1e-4 of the lobe's width.
        compare(&expected, &got, 1e-3, 1e-5).unwrap_or_else(|error| panic!("{distribution:?}: {error}"));
        let other: Vec<[f32; 4]> = evaluate(gpu, BRDF, &Flags::new().with("SPECULAR", true).with("NDF_PHONG", !phong), &rows).unwrap();
        let other: Vec<f64> = other.iter().flat_map(|value| [value[0], value[1], value[2]]).map(f64::from).collect();
        assert!(compare(&expected, &other, 1e-3, 1e-5).is_err(), "the other distribution must not pass");
    }
}

#[test]
fn octahedral_twins_and_their_packing_error() {
    let Some(gpu) = gpu() else { return };
    let wgsl = "#import lobelia::octahedral::{octahedral_encode, octahedral_pack, octahedral_unpack}
struct Input { v: vec4f }
struct Output { encoded: vec4f, back: vec4f }
fn evaluate(input: Input) -> Output {
    return Output(vec4f(octahedral_encode(input.v.xyz), 0.0, 0.0), vec4f(octahedral_unpack(octahedral_pack(input.v.xyz)), 0.0));
}";
    let directions: Vec<Vec3> = (0..100_000u32)
        .map(|index| {
            let [u, v] = r2_point(index, 0);
            let d = direction(u, v).as_vec3();
            if index % 2 == 0 { d } else { -d }
        })
        .chain([Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z])
        .collect();
    let rows: Vec<[f32; 4]> = directions.iter().map(|d| d.extend(0.0).to_array()).collect();
    let found: Vec<[f32; 8]> = evaluate(gpu, wgsl, &Flags::new(), &rows).unwrap();
    let mut worst: f64 = 0.0;
    let (mut expected, mut got) = (Vec::new(), Vec::new());
    for (d, row) in directions.iter().zip(&found) {
        expected.extend(octahedral_encode(d.as_dvec3()).to_array());
        got.extend([f64::from(row[0]), f64::from(row[1])]);
        let back = DVec3::new(row[4].into(), row[5].into(), row[6].into());
        worst = worst.max(back.cross(d.as_dvec3()).length());
        let twin = octahedral_decode(octahedral_encode(d.as_dvec3()));
        assert!(twin.dot(d.as_dvec3()) > 1.0 - 1e-6);
    }
    compare(&expected, &got, 1e-5, 1e-6).unwrap();
    println!("largest error of a packed direction: {worst:.2e} rad");
    assert!(worst < 6.5e-5 && worst > 1e-6, "{worst}");
}

#[test]
fn colours_come_back_within_their_stated_error() {
    let Some(gpu) = gpu() else { return };
    let wgsl = "#import lobelia::packing::{pack_color, pack_shared_exponent, unpack_color, unpack_shared_exponent}
struct Input { color: vec4f }
struct Output { color: vec4f, wide: vec4f }
fn evaluate(input: Input) -> Output {
    return Output(vec4f(unpack_color(pack_color(input.color.xyz)), 0.0), vec4f(unpack_shared_exponent(pack_shared_exponent(input.color.xyz * input.color.w)), 0.0));
}";
    let scales = [1e-4f32, 1.0, 37.0, 60_000.0];
    let rows: Vec<[f32; 4]> = (0..100_000u32)
        .map(|index| {
            let ([a, b], [c, _]) = (r2_point(index, 4), r2_point(index, 5));
            [a as f32, (b * b) as f32, c as f32, scales[index as usize % 4]]
        })
        .collect();
    let found: Vec<[f32; 8]> = evaluate(gpu, wgsl, &Flags::new(), &rows).unwrap();
    for (row, back) in rows.iter().zip(&found) {
        let largest = row[..3].iter().fold(0.0f32, |largest, value| largest.max(value * row[3]));
        for channel in 0..3 {
            let step = if channel == 2 { 1.0 / 1023.0 } else { 1.0 / 2047.0 };
            assert!((back[channel].sqrt() - row[channel].sqrt()).abs() <= 0.51 * step, "{row:?} {back:?}");
            // Half a step of nine bits under the largest channel, or of the smallest exponent.
            let error = (back[4 + channel] - row[channel] * row[3]).abs();
            assert!(error <= largest / 511.0 + 3.0e-8, "{row:?} {back:?}");
        }
    }
}

#[test]
fn sampling_twins_are_equal_bit_for_bit() {
    let Some(gpu) = gpu() else { return };
    let wgsl = "#import lobelia::sampling::{hash, r2_point, radical_inverse}
struct Input { index: u32, seed: u32 }
struct Output { hashed: u32, x: f32, y: f32, inverse: f32 }
fn evaluate(input: Input) -> Output {
    let point = r2_point(input.index, input.seed);
    return Output(hash(input.index), point.x, point.y, radical_inverse(input.index));
}";
    let rows: Vec<[u32; 2]> = (0..100_000u32).map(|index| [index.wrapping_mul(42_949), index % 5 * 1_000_003]).collect();
    let found: Vec<[u32; 4]> = evaluate(gpu, wgsl, &Flags::new(), &rows).unwrap();
    for ([index, seed], row) in rows.iter().zip(&found) {
        let point = r2_point(*index, *seed);
        let twin = [f64::from(f32::from_bits(row[1])), f64::from(f32::from_bits(row[2])), f64::from(f32::from_bits(row[3]))];
        assert_eq!((row[0], twin), (hash(*index), [point[0], point[1], radical_inverse(*index)]));
    }
    assert!(unit_float(u32::MAX) < 1.0);
}

#[test]
fn tone_curve_twins() {
    let Some(gpu) = gpu() else { return };
    let wgsl = "#import lobelia::tonemap::{aces, agx, srgb_encode}
struct Input { color: vec4f }
struct Output { aces: vec4f, agx: vec4f, srgb: vec4f }
fn evaluate(input: Input) -> Output {
    return Output(vec4f(aces(input.color.xyz), 0.0), vec4f(agx(input.color.xyz), 0.0), vec4f(srgb_encode(input.color.xyz), 0.0));
}";
    let rows: Vec<[f32; 4]> = (0..100_000u32)
        .map(|index| {
            let ([a, b], [c, d]) = (r2_point(index, 6), r2_point(index, 7));
            let scale = 10f64.powf(40.0 * d - 10.0);
            [(a * scale) as f32, (b * scale) as f32, (c * scale) as f32, 0.0]
        })
        .chain([[0.0; 4], [1e30; 4], [1e-40; 4], [65504.0; 4]])
        .collect();
    let found: Vec<[f32; 12]> = evaluate(gpu, wgsl, &Flags::new(), &rows).unwrap();
    let (mut expected, mut got) = (Vec::new(), Vec::new());
    for (row, mapped) in rows.iter().zip(&found) {
        let color = DVec3::new(row[0].into(), row[1].into(), row[2].into());
        expected.extend(aces(color).to_array());
        expected.extend(agx(color).to_array());
        expected.extend(color.clamp(DVec3::ZERO, DVec3::ONE).to_array().map(srgb_encode));
        got.extend([0, 1, 2, 4, 5, 6, 8, 9, 10].map(|place| f64::from(mapped[place])));
    }
    // A tenth of an 8-bit step.
    compare(&expected, &got, 0.0, 4e-4).unwrap();
    let wrong: Vec<f64> = expected.iter().map(|value| value + 1e-3).collect();
    assert!(compare(&wrong, &got, 0.0, 4e-4).is_err());
}

#[test]
fn spot_falloff_twins() {
    let Some(gpu) = gpu() else { return };
    let wgsl = "#import lobelia::light::spot_falloff
#import lobelia::scene::PunctualLight
struct Input { cosine: f32, cos_outer: f32, scale: f32, padding: f32 }
struct Output { falloff: f32 }
fn evaluate(input: Input) -> Output {
    return Output(spot_falloff(PunctualLight(vec3f(0.0), 1u, vec3f(0.0), input.cos_outer, vec3f(1.0), input.scale), input.cosine));
}";
    let (mut rows, mut expected) = (Vec::new(), Vec::new());
    for index in 0..100_000u32 {
        let ([a, b], [c, _]) = (r2_point(index, 8), r2_point(index, 9));
        let outer = (0.01 + 1.55 * a).min(std::f64::consts::FRAC_PI_2 - 1e-4);
        let inner = if index % 7 == 0 { outer } else { outer * b };
        let cosine = (2.0 * c - 1.0).clamp(-1.0, 1.0);
        rows.push([cosine as f32, outer.cos() as f32, (1.0 / (inner.cos() - outer.cos()).max(0.001)) as f32, 0.0]);
        expected.push(spot_falloff(f64::from(cosine as f32), inner, outer));
    }
    let found: Vec<f32> = evaluate(gpu, wgsl, &Flags::new(), &rows).unwrap();
    let found: Vec<f64> = found.into_iter().map(f64::from).collect();
    // A hard rim (inner = outer) magnifies the rounding of the cosine a thousandfold.
    compare(&expected, &found, 1e-3, 1e-3).unwrap();
}
