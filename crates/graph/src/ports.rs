//! Ports: the typed inputs and outputs of a pass.
//!
//! A pass writes its ports as plain structs and derives [`Ports`](derive@crate::Ports):
//!
//! ```ignore
//! #[derive(Ports)]
//! pub struct Inputs {
//!     /// Surfaces seen by the camera.
//!     pub gbuffer: GBuffer,                        // required
//!     /// Shadows of the lights; without them every light is visible.
//!     pub visibility: Option<LightVisibility>,     // optional
//!     /// What is summed.
//!     pub terms: Vec<Radiance>,                    // a list, zero or more
//!     /// This pass's result of the frame before.
//!     pub previous: History<Radiance>,             // last frame's value
//! }
//! ```
//!
//! The graph reads names, types, multiplicity and documentation off the struct, and beside it the derive writes `InputsShapes` with the same
//! fields holding [`Resource::Shape`]s, which is what planning sees.

use crate::resource::{Part, PartSet, Resource};
use std::any::{Any, TypeId};

/// How many producers a port takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arity {
    /// Exactly one.
    One,
    /// One or none.
    Optional,
    /// Any number, none included, in the order of the file.
    List,
}

/// A shape whose type has been forgotten.
pub trait AnyShape: Any + Send + Sync {
    /// For downcasting.
    fn as_any(&self) -> &dyn Any;
    /// A copy.
    fn boxed_clone(&self) -> Box<dyn AnyShape>;
    /// `Debug` text, part of a plan's fingerprint.
    fn describe(&self) -> String;
}

impl<T: Any + Clone + std::fmt::Debug + Send + Sync> AnyShape for T {
    fn as_any(&self) -> &dyn Any {
        self
    }
    fn boxed_clone(&self) -> Box<dyn AnyShape> {
        Box::new(self.clone())
    }
    fn describe(&self) -> String {
        format!("{self:?}")
    }
}

/// The type of a port's resource, with the little that the graph must do with it.
#[derive(Clone, Copy)]
pub struct ResourceType {
    /// Identity.
    pub id: TypeId,
    /// [`Resource::NAME`].
    pub name: &'static str,
    /// [`Resource::DOC`].
    pub doc: &'static str,
    /// [`Resource::parts`] on a forgotten shape. The shape must be of this resource.
    pub parts: fn(&dyn AnyShape) -> Vec<Part>,
}

impl ResourceType {
    /// The type `R`.
    pub fn of<R: Resource>() -> Self {
        Self {
            id: TypeId::of::<R>(),
            name: R::NAME,
            doc: R::DOC,
            parts: |shape| shape.as_any().downcast_ref::<R::Shape>().map(R::parts).unwrap_or_default(),
        }
    }
}

impl PartialEq for ResourceType {
    fn eq(&self, other: &Self) -> bool {
        self.id == other.id
    }
}

impl std::fmt::Debug for ResourceType {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(self.name)
    }
}

/// One port, as the graph sees it.
#[derive(Clone, Debug)]
pub struct PortInfo {
    /// Field name.
    pub name: &'static str,
    /// Field documentation.
    pub doc: &'static str,
    /// What flows.
    pub resource: ResourceType,
    /// How many producers.
    pub arity: Arity,
    /// Whether the value of the frame before is read, which makes no ordering edge.
    pub history: bool,
}

/// What is connected to one port: for each producer, its shape and (when running) its parts.
#[derive(Default)]
pub struct PortValue {
    /// Shapes, one per connected producer.
    pub shapes: Vec<Box<dyn AnyShape>>,
    /// Parts, one set per connected producer; empty while planning.
    pub parts: Vec<PartSet>,
}

impl PortValue {
    /// A copy.
    pub fn duplicate(&self) -> Self {
        Self { shapes: self.shapes.iter().map(|shape| shape.as_ref().boxed_clone()).collect(), parts: self.parts.clone() }
    }
}

/// A struct of ports. Derive it.
pub trait Ports: Sized + 'static {
    /// The same struct with shapes instead of resources.
    type Shapes: 'static;
    /// The ports in field order.
    fn infos() -> Vec<PortInfo>;
    /// Shapes from what is connected, in the order of [`Ports::infos`]; `None` if a required port has nothing.
    fn shapes(values: &[PortValue]) -> Option<Self::Shapes>;
    /// The reverse of [`Ports::shapes`].
    fn erase(shapes: &Self::Shapes) -> Vec<Vec<Box<dyn AnyShape>>>;
    /// The resources; `None` if a required port has nothing.
    fn assemble(values: &[PortValue]) -> Option<Self>;
}

/// No ports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NoPorts;

impl Ports for NoPorts {
    type Shapes = NoPorts;
    fn infos() -> Vec<PortInfo> {
        Vec::new()
    }
    fn shapes(_: &[PortValue]) -> Option<Self::Shapes> {
        Some(NoPorts)
    }
    fn erase(_: &Self::Shapes) -> Vec<Vec<Box<dyn AnyShape>>> {
        Vec::new()
    }
    fn assemble(_: &[PortValue]) -> Option<Self> {
        Some(NoPorts)
    }
}

/// Last frame's value of a resource.
///
/// In the first frame, and in the first frame after the history was reset (a parameter, a variant or the size changed), all parts are zero and
/// [`crate::Frame::history_is_valid`] says `false`.
#[derive(Clone, Debug)]
pub struct History<R>(pub R);

/// What may stand as the type of a port's field. Implemented for `R`, `Option<R>`, `Vec<R>` and `History<R>`.
pub trait PortField: Sized + 'static {
    /// The field's type in the shapes struct.
    type Shape: 'static;
    /// What flows.
    fn resource() -> ResourceType;
    /// How many.
    const ARITY: Arity;
    /// Whether it is last frame's.
    const HISTORY: bool;
    /// Shape from what is connected.
    fn shape(value: &PortValue) -> Option<Self::Shape>;
    /// The reverse.
    fn erase(shape: &Self::Shape) -> Vec<Box<dyn AnyShape>>;
    /// The resource.
    fn assemble(value: &PortValue) -> Option<Self>;
}

fn shape_at<R: Resource>(value: &PortValue, index: usize) -> Option<R::Shape> {
    value.shapes.get(index)?.as_ref().as_any().downcast_ref::<R::Shape>().cloned()
}

fn resource_at<R: Resource>(value: &PortValue, index: usize) -> Option<R> {
    Some(R::assemble(&shape_at::<R>(value, index)?, value.parts.get(index)?))
}

fn erased<T: AnyShape + Clone>(shape: &T) -> Box<dyn AnyShape> {
    Box::new(shape.clone())
}

impl<R: Resource> PortField for R {
    type Shape = R::Shape;
    const ARITY: Arity = Arity::One;
    const HISTORY: bool = false;
    fn resource() -> ResourceType {
        ResourceType::of::<R>()
    }
    fn shape(value: &PortValue) -> Option<Self::Shape> {
        shape_at::<R>(value, 0)
    }
    fn erase(shape: &Self::Shape) -> Vec<Box<dyn AnyShape>> {
        vec![erased(shape)]
    }
    fn assemble(value: &PortValue) -> Option<Self> {
        resource_at::<R>(value, 0)
    }
}

impl<R: Resource> PortField for Option<R> {
    type Shape = Option<R::Shape>;
    const ARITY: Arity = Arity::Optional;
    const HISTORY: bool = false;
    fn resource() -> ResourceType {
        ResourceType::of::<R>()
    }
    fn shape(value: &PortValue) -> Option<Self::Shape> {
        Some(shape_at::<R>(value, 0))
    }
    fn erase(shape: &Self::Shape) -> Vec<Box<dyn AnyShape>> {
        shape.iter().map(erased).collect()
    }
    fn assemble(value: &PortValue) -> Option<Self> {
        Some(resource_at::<R>(value, 0))
    }
}

impl<R: Resource> PortField for Vec<R> {
    type Shape = Vec<R::Shape>;
    const ARITY: Arity = Arity::List;
    const HISTORY: bool = false;
    fn resource() -> ResourceType {
        ResourceType::of::<R>()
    }
    fn shape(value: &PortValue) -> Option<Self::Shape> {
        (0..value.shapes.len()).map(|index| shape_at::<R>(value, index)).collect()
    }
    fn erase(shape: &Self::Shape) -> Vec<Box<dyn AnyShape>> {
        shape.iter().map(erased).collect()
    }
    fn assemble(value: &PortValue) -> Option<Self> {
        (0..value.parts.len()).map(|index| resource_at::<R>(value, index)).collect()
    }
}

/// A history has no shape while planning: its producer may be planned after its reader, or be the reader itself.
impl<R: Resource> PortField for History<R> {
    type Shape = ();
    const ARITY: Arity = Arity::One;
    const HISTORY: bool = true;
    fn resource() -> ResourceType {
        ResourceType::of::<R>()
    }
    fn shape(_: &PortValue) -> Option<Self::Shape> {
        Some(())
    }
    fn erase((): &Self::Shape) -> Vec<Box<dyn AnyShape>> {
        Vec::new()
    }
    fn assemble(value: &PortValue) -> Option<Self> {
        resource_at::<R>(value, 0).map(History)
    }
}
