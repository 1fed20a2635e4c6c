//! A toy world for planning tests: resources without meaning, passes without shaders.
#![allow(dead_code, missing_docs, clippy::unwrap_used)]

use lobelia_graph::{
    BuildError, CreateContext, DeviceOf, Frame, GraphFile, History, InputShapes, Need, NoParams, NoPorts, OrNone, OutputShapes, Override,
    Params, Part, PartSet, Pass, Plan, PlanContext, PlanOptions, PortError, Ports, Problems, Registry, Resource, RunError, Specialisation,
    TexturePart, TraitsOf, Values, Wired, World,
};
use serde::{Deserialize, Serialize};

#[derive(Clone, Debug, PartialEq)]
pub struct Facts {
    pub lights: usize,
    pub specular: bool,
}

pub const LIT: Facts = Facts { lights: 1, specular: true };
pub const DARK: Facts = Facts { lights: 0, specular: true };
pub const DIFFUSE: Facts = Facts { lights: 1, specular: false };

pub struct Toy;
impl World for Toy {
    type Traits = Facts;
    type Device = ();
    /// A bit for each thing that a toy adds.
    type Claim = u8;
    fn unspecialised(traits: &Facts) -> Facts {
        Facts { specular: true, ..traits.clone() }
    }
}

macro_rules! image_resource {
    ($name:ident, $doc:literal) => {
        #[derive(Clone, Debug)]
        pub struct $name {
            pub image: TexturePart,
        }
        impl Resource for $name {
            const NAME: &'static str = stringify!($name);
            const DOC: &'static str = $doc;
            type Shape = [u32; 2];
            fn parts(shape: &[u32; 2]) -> Vec<Part> {
                let usage = wgpu::TextureUsages::STORAGE_BINDING;
                vec![Part::texture("image", wgpu::TextureFormat::Rgba16Float, *shape, usage).values(Values::NonNegative)]
            }
            fn assemble(_: &[u32; 2], parts: &PartSet) -> Self {
                Self { image: parts.texture("image") }
            }
        }
    };
}
image_resource!(Surface, "Where the light falls.");
image_resource!(Light, "Light.");
image_resource!(Shade, "Where it does not.");
image_resource!(Screen, "What is seen.");

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Params)]
#[serde(default, deny_unknown_fields)]
pub struct LampParams {
    /// How many.
    #[param(range = 1..=64, unit = "lamps")]
    pub count: u32,
    /// Upper bound.
    #[param(range = 0.0..)]
    pub clamp: OrNone<f32>,
    /// Any finite number.
    pub tilt: f32,
    /// Off or on.
    pub warm: bool,
    /// Switch: `lit` runs, `absent` is left out, `bypass` hands its input on.
    pub mode: Mode,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    #[default]
    Lit,
    Absent,
    Bypass,
}

impl lobelia_graph::ParamValue for Mode {
    fn kind() -> String {
        "lit, absent or bypass".into()
    }
}

impl Default for LampParams {
    fn default() -> Self {
        Self { count: 4, clamp: OrNone::None, tilt: 0.0, warm: true, mode: Mode::Lit }
    }
}

#[derive(Ports)]
pub struct SurfaceOut {
    /// Made from nothing.
    pub surface: Surface,
}
#[derive(Ports)]
pub struct LampIn {
    /// Lit surface.
    pub surface: Surface,
    /// Shadow.
    pub shade: Option<Shade>,
}
#[derive(Ports)]
pub struct LightOut {
    /// Light.
    pub light: Light,
}
#[derive(Ports)]
pub struct ShadeOut {
    /// Shade.
    pub shade: Shade,
}
#[derive(Ports)]
pub struct FilterIn {
    /// What is filtered.
    pub light: Light,
}
#[derive(Ports)]
pub struct SumIn {
    /// Terms.
    pub terms: Vec<Light>,
}
#[derive(Ports)]
pub struct BlendIn {
    /// Now.
    pub light: Light,
    /// Before.
    pub previous: History<Light>,
}
#[derive(Ports)]
pub struct ScreenOut {
    /// Picture.
    pub screen: Screen,
}

/// A lamp claims the bit of its count; nothing else claims anything.
fn claim_of_lamp(kind: &str, params: &dyn std::any::Any) -> Option<u8> {
    let lamp = params.downcast_ref::<LampParams>().filter(|_| kind == "toy-lamp")?;
    1u8.checked_shl(lamp.count)
}

macro_rules! toy_pass {
    ($type:ident, $name:literal, $params:ty, $inputs:ty, $outputs:ty, need: $need:expr, shape: $shape:expr, specialise: $specialise:expr) => {
        pub struct $type;
        impl Pass for $type {
            const NAME: &'static str = $name;
            const DOC: &'static str = "A toy.";
            type World = Toy;
            type Params = $params;
            type Inputs = $inputs;
            type Outputs = $outputs;
            type Bindings = ();
            fn need(params: &Self::Params, traits: &TraitsOf<Self>) -> Need {
                let need: fn(&$params, &Facts) -> Need = $need;
                need(params, traits)
            }
            fn claim(params: &Self::Params, _: &TraitsOf<Self>) -> Option<u8> {
                claim_of_lamp(Self::NAME, params)
            }
            fn specialise(context: &PlanContext<'_, Self>, _: &InputShapes<Self>) -> Vec<Specialisation> {
                let specialise: fn(&Facts) -> Vec<Specialisation> = $specialise;
                specialise(context.traits)
            }
            fn shape(context: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Result<OutputShapes<Self>, PortError> {
                let shape: fn(&PlanContext<'_, Self>, &InputShapes<Self>) -> Result<OutputShapes<Self>, PortError> = $shape;
                shape(context, inputs)
            }
            fn create(_: &CreateContext<'_, Self>) -> Result<Self, BuildError> {
                Ok(Self)
            }
            fn bind(&self, _: &CreateContext<'_, Self>, _: &Self::Inputs, _: &Self::Outputs) -> Result<(), BuildError> {
                Ok(())
            }
            fn record(&mut self, _: &mut Frame<'_>, _: &DeviceOf<Self>, _: &()) -> Result<(), RunError> {
                Ok(())
            }
        }
    };
}

toy_pass!(MakeSurface, "surface", NoParams, NoPorts, SurfaceOut,
    need: |_, _| Need::Run,
    shape: |context, _| Ok(SurfaceOutShapes { surface: context.extent }),
    specialise: |facts| vec![Specialisation::new("SPECULAR", facts.specular, "the scene's materials")]);
toy_pass!(Shadow, "shadow", NoParams, NoPorts, ShadeOut,
    need: |_, facts| if facts.lights > 0 { Need::Run } else { Need::Omit("the scene has no light".into()) },
    shape: |context, _| Ok(ShadeOutShapes { shade: context.extent }),
    specialise: |_| Vec::new());
toy_pass!(Lamp, "toy-lamp", LampParams, LampIn, LightOut,
    need: |params, facts| match params.mode {
        Mode::Absent => Need::Omit("it is switched off".into()),
        _ if facts.lights == 0 => Need::Omit("the scene has no light".into()),
        _ => Need::Run,
    },
    shape: |context, inputs| {
        if inputs.shade.is_some_and(|shade| shade != inputs.surface) {
            return Err(PortError::at("shade", "it has another size than the surface").help("use one size"));
        }
        if context.params.count > 32 {
            return Err(PortError::new("more than 32 lamps do not fit"));
        }
        Ok(LightOutShapes { light: inputs.surface })
    },
    specialise: |_| Vec::new());
toy_pass!(Filter, "filter", LampParams, FilterIn, LightOut,
    need: |params, _| match params.mode {
        Mode::Lit => Need::Run,
        Mode::Absent => Need::Omit("it is switched off".into()),
        Mode::Bypass => Need::Forward("the filter is off".into()),
    },
    shape: |_, inputs| Ok(LightOutShapes { light: inputs.light }),
    specialise: |_| Vec::new());
toy_pass!(Sum, "sum", NoParams, SumIn, LightOut,
    need: |_, _| Need::Run,
    shape: |context, _| Ok(LightOutShapes { light: context.extent }),
    specialise: |_| Vec::new());
toy_pass!(Blend, "blend", NoParams, BlendIn, LightOut,
    need: |_, _| Need::Run,
    shape: |_, inputs| Ok(LightOutShapes { light: inputs.light }),
    specialise: |_| Vec::new());
toy_pass!(Show, "show", NoParams, FilterIn, ScreenOut,
    need: |_, _| Need::Run,
    shape: |_, inputs| Ok(ScreenOutShapes { screen: inputs.light }),
    specialise: |_| Vec::new());

pub fn registry() -> Registry<Toy> {
    let mut registry = Registry::new();
    registry.add::<MakeSurface>().add::<Shadow>().add::<Lamp>().add::<Filter>().add::<Sum>().add::<Blend>().add::<Show>();
    registry
}

pub fn wire(text: &str, variants: &[&str], sets: &[&str]) -> Result<Wired<Toy>, Problems> {
    let variants: Vec<String> = variants.iter().map(|name| (*name).to_owned()).collect();
    let overrides: Vec<Override> = sets.iter().map(|text| text.parse().unwrap()).collect();
    GraphFile::parse(text, "test.ron")?.wire(&registry(), &variants, &overrides)
}

pub fn plan(text: &str, facts: &Facts) -> Result<Plan<Toy>, Problems> {
    wire(text, &[], &[])?.plan(facts, &PlanOptions::new([8, 4]))
}

/// The passes that run, in order.
pub fn names(plan: &Plan<Toy>) -> Vec<&str> {
    plan.passes.iter().map(|pass| pass.name.as_str()).collect()
}

/// The text of the problems that `result` must have.
pub fn problems<T>(result: Result<T, Problems>) -> String {
    match result {
        Ok(_) => panic!("this should have been refused"),
        Err(problems) => problems.to_string(),
    }
}
