//! The [`Pass`] trait: one technique's step, written once, checked without a device, run on one.

use crate::{
    error::{BuildError, PortError, RunError},
    gpu::Gpu,
    params::Params,
    ports::Ports,
    run::Frame,
};
use lobelia_shaders::Flags;
use std::{fmt::Debug, ops::BitOrAssign};

/// What the graph is run on: the host program's scene.
///
/// The graph knows no scene type. A host names two: facts for planning, and the scene on the device for running.
pub trait World: Sized + 'static {
    /// Facts that passes ask when they decide whether a scene needs them and which flags specialise their shaders.
    type Traits: Clone + Debug + PartialEq + 'static;
    /// The scene on the device: buffers, textures, draw lists, the camera.
    type Device: 'static;
    /// What a pass adds to a picture, such as the light of some lamps along some paths: what the picture can fairly be compared with. The graph only joins claims
    /// (`|=` must be a union: the order and repetition of terms change nothing; the default is the claim of nothing).
    type Claim: Clone + Debug + Default + PartialEq + BitOrAssign + 'static;
    /// The same facts with everything that permits leaving something out taken away. A plan made with these is the unpruned one, against which
    /// savings are measured and images compared.
    fn unspecialised(traits: &Self::Traits) -> Self::Traits;
    /// What the world's light is multiplied by, so that radiance fits half floats; a power of two, and 1 unless the host says otherwise. Passes work in these
    /// units and need not know; only what brings light out of the graph does (a tone curve, [`crate::Runner::read`]).
    fn pre_exposure(device: &Self::Device) -> f32 {
        let _ = device;
        1.0
    }
}

/// Facts of the world of pass `P`.
pub type TraitsOf<P> = <<P as Pass>::World as World>::Traits;
/// Claim of the world of pass `P`.
pub type ClaimOf<P> = <<P as Pass>::World as World>::Claim;
/// Device scene of the world of pass `P`.
pub type DeviceOf<P> = <<P as Pass>::World as World>::Device;
/// Input shapes of pass `P`.
pub type InputShapes<P> = <<P as Pass>::Inputs as Ports>::Shapes;
/// Output shapes of pass `P`.
pub type OutputShapes<P> = <<P as Pass>::Outputs as Ports>::Shapes;

/// Whether a scene needs a pass, with the reason that `lobelia explain` prints.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Need {
    /// It runs.
    Run,
    /// It is switched off: each output hands on the first connected input of the same type.
    Forward(String),
    /// It is left out, and with it whatever cannot do without its outputs and whatever only fed it.
    Omit(String),
}

/// One shader flag and why it has its value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Specialisation {
    /// Flag as the shaders know it.
    pub flag: &'static str,
    /// Whether it is on.
    pub on: bool,
    /// Which fact decided, for `lobelia explain`.
    pub reason: String,
}

impl Specialisation {
    /// A flag with its reason.
    pub fn new(flag: &'static str, on: bool, reason: impl Into<String>) -> Self {
        Self { flag, on, reason: reason.into() }
    }
}

/// What a pass may ask while the graph is planned.
pub struct PlanContext<'a, P: Pass> {
    /// Name of the pass in the file.
    pub name: &'a str,
    /// Its parameters.
    pub params: &'a P::Params,
    /// Facts of the scene.
    pub traits: &'a TraitsOf<P>,
    /// Size of the picture in pixels, width and height.
    pub extent: [u32; 2],
}

/// What a pass has when it creates its pipelines.
pub struct CreateContext<'a, P: Pass> {
    /// Name of the pass in the file.
    pub name: &'a str,
    /// Its parameters.
    pub params: &'a P::Params,
    /// Facts of the scene.
    pub traits: &'a TraitsOf<P>,
    /// Size of the picture in pixels.
    pub extent: [u32; 2],
    /// Device, queue, pipeline cache.
    pub gpu: &'a Gpu,
    /// The scene on the device.
    pub world: &'a DeviceOf<P>,
    /// Shader flags that [`Pass::specialise`] decided.
    pub flags: &'a Flags,
    /// Shapes of what is connected.
    pub inputs: &'a InputShapes<P>,
    /// Shapes of what it makes.
    pub outputs: &'a OutputShapes<P>,
}

/// A step of a pipeline.
///
/// `need`, `specialise` and `shape` are pure. `create` makes pipelines, `bind` makes bind groups (twice when the graph has history, once for each
/// side of the swap), `record` writes commands and should do nothing that allocates.
pub trait Pass: Sized + 'static {
    /// Name in the registry, in kebab case; a graph file may write `_` for `-`.
    const NAME: &'static str;
    /// What it computes and where that comes from. The first line is the summary in `lobelia passes`.
    const DOC: &'static str;
    /// The world it runs on.
    type World: World;
    /// Parameters.
    type Params: Params;
    /// Input ports.
    type Inputs: Ports;
    /// Output ports.
    type Outputs: Ports;
    /// Bind groups, and whatever else depends on the concrete resources.
    type Bindings: 'static;

    /// Whether this scene needs the pass. `params` are in range.
    fn need(params: &Self::Params, traits: &TraitsOf<Self>) -> Need {
        let _ = (params, traits);
        Need::Run
    }

    /// What the pass itself adds to a picture, whether it does it well or not. What it is made from is not its own: the claim of a picture is the union over all
    /// passes behind it, [`crate::Plan::claim`]. `None`, the default, states nothing: right for passes that forward, sum, filter or display, and for those that only
    /// prepare what others use. `params` are in range.
    fn claim(params: &Self::Params, traits: &TraitsOf<Self>) -> Option<ClaimOf<Self>> {
        let _ = (params, traits);
        None
    }

    /// Shader flags that the scene or the inputs decide.
    fn specialise(context: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Vec<Specialisation> {
        let _ = (context, inputs);
        Vec::new()
    }

    /// What a user should know of what this pass does not do, or not as asked, on this scene. Shown by whatever renders or explains; asked after
    /// [`Pass::shape`] said that the pass can run.
    fn warnings(context: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Vec<String> {
        let _ = (context, inputs);
        Vec::new()
    }

    /// Shapes of the outputs, or what is wrong with the inputs.
    fn shape(context: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Result<OutputShapes<Self>, PortError>;

    /// Creates pipelines and persistent objects.
    fn create(context: &CreateContext<'_, Self>) -> Result<Self, BuildError>;

    /// Creates bind groups.
    fn bind(&self, context: &CreateContext<'_, Self>, inputs: &Self::Inputs, outputs: &Self::Outputs)
    -> Result<Self::Bindings, BuildError>;

    /// Records one frame.
    fn record(&mut self, frame: &mut Frame<'_>, world: &DeviceOf<Self>, bindings: &Self::Bindings) -> Result<(), RunError>;
}
