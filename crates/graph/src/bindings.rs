//! Bind groups by name.
//!
//! A pass gives each WGSL variable what belongs there; names, kinds and rights are checked against the shader, so a slip is an error in words and
//! not a validation failure about a number.

use crate::{
    error::BuildError,
    gpu::Gpu,
    pipeline::{ComputePipeline, DeclaredBinding, RasterPipeline, Reflection, checked},
    resource::{Access, BufferPart, TexturePart},
};
use lobelia_base::nearest;
use std::sync::Arc;

enum Value<'a> {
    View(&'a wgpu::TextureView),
    Buffer(&'a wgpu::Buffer),
    Sampler(&'a wgpu::Sampler),
}

impl Value<'_> {
    fn kind(&self) -> &'static str {
        match self {
            Value::View(_) => "a texture",
            Value::Buffer(_) => "a buffer",
            Value::Sampler(_) => "a sampler",
        }
    }
}

struct Given<'a> {
    name: &'a str,
    value: Value<'a>,
    /// Label of an input that must not be written.
    read_only: Option<&'a str>,
}

/// Collects what a bind group holds.
pub struct Bindings<'a> {
    reflection: Arc<Reflection>,
    group: u32,
    given: Vec<Given<'a>>,
}

impl ComputePipeline {
    /// Starts a bind group of this pipeline.
    pub fn bindings<'a>(&self, group: u32) -> Bindings<'a> {
        Bindings { reflection: self.reflection().clone(), group, given: Vec::new() }
    }
}

impl RasterPipeline {
    /// Starts a bind group of this pipeline.
    pub fn bindings<'a>(&self, group: u32) -> Bindings<'a> {
        Bindings { reflection: self.reflection().clone(), group, given: Vec::new() }
    }
}

impl<'a> Bindings<'a> {
    fn give(mut self, name: &'a str, value: Value<'a>, read_only: Option<&'a str>) -> Self {
        self.given.push(Given { name, value, read_only });
        self
    }

    /// A texture of a port, all layers and mips.
    pub fn texture(self, name: &'a str, part: &'a TexturePart) -> Self {
        let read_only = (part.access() == Access::Read).then(|| part.label());
        self.give(name, Value::View(part.view()), read_only)
    }

    /// As [`Bindings::texture`], if there is one.
    pub fn texture_if(self, name: &'a str, part: Option<&'a TexturePart>) -> Self {
        match part {
            Some(part) => self.texture(name, part),
            None => self,
        }
    }

    /// A texture view of the pass's own.
    pub fn view(self, name: &'a str, view: &'a wgpu::TextureView) -> Self {
        self.give(name, Value::View(view), None)
    }

    /// A buffer of a port.
    pub fn buffer(self, name: &'a str, part: &'a BufferPart) -> Self {
        let read_only = (part.access() == Access::Read).then(|| part.label());
        self.give(name, Value::Buffer(part.buffer()), read_only)
    }

    /// As [`Bindings::buffer`], if there is one.
    pub fn buffer_if(self, name: &'a str, part: Option<&'a BufferPart>) -> Self {
        match part {
            Some(part) => self.buffer(name, part),
            None => self,
        }
    }

    /// A buffer of the scene or of the pass's own.
    pub fn raw_buffer(self, name: &'a str, buffer: &'a wgpu::Buffer) -> Self {
        self.give(name, Value::Buffer(buffer), None)
    }

    /// A sampler.
    pub fn sampler(self, name: &'a str, sampler: &'a wgpu::Sampler) -> Self {
        self.give(name, Value::Sampler(sampler), None)
    }

    /// Checks and creates the bind group. What the shader declares but does not use is left out silently.
    pub fn build(self, gpu: &Gpu) -> Result<wgpu::BindGroup, BuildError> {
        let reflection = &self.reflection;
        let mut entries = Vec::new();
        for given in &self.given {
            let declared =
                reflection.bindings.iter().find(|declared| declared.name == given.name).ok_or_else(|| BuildError::UnknownBinding {
                    shader: reflection.shader.clone(),
                    name: given.name.to_owned(),
                    nearest: nearest(given.name, reflection.bindings.iter().map(|declared| declared.name.as_str())).map(str::to_owned),
                })?;
            if let (Some(kind), true) = (declared.kind, declared.group == self.group) {
                self.check(declared, kind, given)?;
                let resource = match given.value {
                    Value::View(view) => wgpu::BindingResource::TextureView(view),
                    Value::Buffer(buffer) => buffer.as_entire_binding(),
                    Value::Sampler(sampler) => wgpu::BindingResource::Sampler(sampler),
                };
                entries.push(wgpu::BindGroupEntry { binding: declared.binding, resource });
            }
        }
        let wanted = reflection.bindings.iter().filter(|declared| declared.group == self.group && declared.kind.is_some());
        for declared in wanted {
            if !entries.iter().any(|entry| entry.binding == declared.binding) {
                return Err(BuildError::MissingBinding {
                    shader: reflection.shader.clone(),
                    entry: reflection.entry.clone(),
                    name: declared.name.clone(),
                    group: self.group,
                });
            }
        }
        let Some(layout) = reflection.layouts.get(&self.group) else {
            return Err(BuildError::Other(format!("shader `{}` has no bind group {}", reflection.shader, self.group)));
        };
        let group =
            gpu.device().create_bind_group(&wgpu::BindGroupDescriptor { label: Some(&reflection.shader), layout, entries: &entries });
        Ok(checked(gpu, group)?)
    }

    fn check(&self, declared: &DeclaredBinding, kind: wgpu::BindingType, given: &Given<'_>) -> Result<(), BuildError> {
        let (wanted, fits, writes) = match kind {
            wgpu::BindingType::Buffer { ty, .. } => {
                let writes = ty == wgpu::BufferBindingType::Storage { read_only: false };
                ("a buffer", matches!(given.value, Value::Buffer(_)), writes)
            }
            wgpu::BindingType::StorageTexture { access, .. } => {
                ("a storage texture", matches!(given.value, Value::View(_)), access != wgpu::StorageTextureAccess::ReadOnly)
            }
            wgpu::BindingType::Sampler(_) => ("a sampler", matches!(given.value, Value::Sampler(_)), false),
            _ => ("a texture", matches!(given.value, Value::View(_)), false),
        };
        let shader = self.reflection.shader.clone();
        if !fits {
            let given = given.value.kind().to_owned();
            return Err(BuildError::BindingKind { shader, name: declared.name.clone(), declared: wanted.to_owned(), given });
        }
        match given.read_only {
            Some(resource) if writes => Err(BuildError::WritesInput { shader, name: declared.name.clone(), resource: resource.to_owned() }),
            _ => Ok(()),
        }
    }
}
