//! The render graph: typed passes, wired by a RON file, planned without a device, run on one.
//!
//! The **plan** is pure: parse, wire, check types, prune, specialise, shape, order, share memory. The **run** owns every resource: it allocates,
//! creates pipelines, binds, records, times and reads back. This crate knows no concrete pass, resource or scene.

// Lets the derive macros name this crate from inside its own tests.
extern crate self as lobelia_graph;

pub mod bindings;
pub mod check;
pub mod error;
pub mod file;
pub mod gpu;
pub mod params;
pub mod pass;
pub mod pipeline;
pub mod plan;
pub mod ports;
pub mod problem;
pub mod readback;
pub mod registry;
pub mod resource;
pub mod run;
pub mod testing;
pub mod timing;
pub mod wire;

pub use error::{BuildError, GpuError, PortError, RunError};
pub use file::GraphFile;
pub use gpu::{Gpu, GpuOptions, MAX_STORAGE_BINDING};
pub use lobelia_graph_derive::{Params, Ports};
pub use params::{NoParams, OrNone, ParamInfo, ParamProblem, ParamValue, Params};
pub use pass::{ClaimOf, CreateContext, DeviceOf, InputShapes, Need, OutputShapes, Pass, PlanContext, Specialisation, TraitsOf, World};
pub use pipeline::{ComputePipeline, RasterDescription, RasterPipeline};
pub use plan::{Dropped, Plan, PlanOptions, PlannedPass, PlannedResource, Slot};
pub use ports::{AnyShape, Arity, History, NoPorts, PortField, PortInfo, PortValue, Ports, ResourceType};
pub use problem::{Problem, Problems};
pub use readback::TextureData;
pub use registry::{PassInfo, Registry};
pub use resource::{Access, BufferPart, BufferShape, Part, PartHandle, PartKind, PartSet, Resource, TexturePart, TextureShape, Values};
pub use run::{Frame, FrameInfo, FrameReport, PartData, PassTime, Progress, RunOptions, Runner, Timing, WorkRate};
pub use wire::{Override, Wired};
