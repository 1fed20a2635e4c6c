//! Pipelines whose bind group layouts are read off the shader, and the cache that hands out equal ones again.

use crate::{
    error::{BuildError, GpuError},
    gpu::{Gpu, PipelineStatistics},
};
use lobelia_shaders::{Composed, Composer, Flags, ShaderError, Source};
use std::{
    collections::{BTreeMap, HashMap},
    hash::{DefaultHasher, Hash, Hasher},
    sync::Arc,
    time::Instant,
};

/// A binding as a shader declares it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DeclaredBinding {
    /// Name of the WGSL variable.
    pub name: String,
    /// `@group`.
    pub group: u32,
    /// `@binding`.
    pub binding: u32,
    /// What the device wants there; `None` if the pipeline's entry points do not use it.
    pub kind: Option<wgpu::BindingType>,
    /// Stages that use it.
    pub visibility: wgpu::ShaderStages,
}

/// What reflection found in a shader, shared by the pipelines made of it.
#[derive(Debug)]
pub struct Reflection {
    /// Path of the entry file.
    pub shader: String,
    /// Entry points, for errors.
    pub entry: String,
    /// Every binding that the module declares.
    pub bindings: Vec<DeclaredBinding>,
    /// Layouts by group.
    pub layouts: BTreeMap<u32, wgpu::BindGroupLayout>,
}

/// A compute pipeline with what reflection knows of it. Cheap to clone.
#[derive(Clone, Debug)]
pub struct ComputePipeline {
    raw: wgpu::ComputePipeline,
    reflection: Arc<Reflection>,
    workgroup: [u32; 3],
}

impl ComputePipeline {
    /// The wgpu pipeline.
    pub fn raw(&self) -> &wgpu::ComputePipeline {
        &self.raw
    }

    /// Bindings and layouts.
    pub fn reflection(&self) -> &Arc<Reflection> {
        &self.reflection
    }

    /// Workgroups that cover `size` invocations.
    pub fn workgroups(&self, size: [u32; 3]) -> [u32; 3] {
        std::array::from_fn(|axis| size[axis].div_ceil(self.workgroup[axis]))
    }

    /// Workgroups that cover a picture.
    pub fn workgroups_2d(&self, extent: [u32; 2]) -> [u32; 2] {
        let [x, y, _] = self.workgroups([extent[0], extent[1], 1]);
        [x, y]
    }
}

/// A raster pipeline with what reflection knows of it. Cheap to clone.
#[derive(Clone, Debug)]
pub struct RasterPipeline {
    raw: wgpu::RenderPipeline,
    reflection: Arc<Reflection>,
}

impl RasterPipeline {
    /// The wgpu pipeline.
    pub fn raw(&self) -> &wgpu::RenderPipeline {
        &self.raw
    }

    /// Bindings and layouts.
    pub fn reflection(&self) -> &Arc<Reflection> {
        &self.reflection
    }
}

/// What a raster pipeline is made of.
pub struct RasterDescription<'a> {
    /// Debug label.
    pub label: &'a str,
    /// Entry file.
    pub source: Source<'a>,
    /// Vertex entry point.
    pub vertex_entry: &'a str,
    /// Fragment entry point; `None` writes depth only.
    pub fragment_entry: Option<&'a str>,
    /// Shader flags.
    pub flags: &'a Flags,
    /// Vertex buffers.
    pub vertex_buffers: &'a [wgpu::VertexBufferLayout<'a>],
    /// Colour targets.
    pub targets: &'a [Option<wgpu::ColorTargetState>],
    /// Depth test.
    pub depth: Option<wgpu::DepthStencilState>,
    /// Topology and culling.
    pub primitive: wgpu::PrimitiveState,
    /// Groups whose layout somebody else owns, such as the scene's materials; the others are read off the shader.
    pub layouts: &'a [(u32, wgpu::BindGroupLayout)],
}

/// Composed shaders and pipelines by what they were made of.
#[derive(Default)]
pub(crate) struct Cache {
    composer: Option<Composer>,
    shaders: HashMap<u64, Arc<Shader>>,
    layouts: Vec<(Vec<wgpu::BindGroupLayoutEntry>, wgpu::BindGroupLayout)>,
    compute: HashMap<u64, ComputePipeline>,
    raster: HashMap<u64, RasterPipeline>,
    statistics: PipelineStatistics,
}

struct Shader {
    path: String,
    composed: Composed,
    module: wgpu::ShaderModule,
}

fn hash_of(parts: impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    parts.hash(&mut hasher);
    hasher.finish()
}

impl Cache {
    pub fn composer(&mut self) -> Result<&mut Composer, ShaderError> {
        if self.composer.is_none() {
            self.composer = Some(Composer::new()?);
        }
        match &mut self.composer {
            Some(composer) => Ok(composer),
            None => unreachable!("it was just made"),
        }
    }

    pub fn statistics(&self) -> PipelineStatistics {
        self.statistics
    }

    fn shader(&mut self, gpu: &Gpu, source: Source<'_>, flags: &Flags) -> Result<(u64, Arc<Shader>), BuildError> {
        let key = hash_of((source.path, source.text, flags));
        if let Some(shader) = self.shaders.get(&key) {
            return Ok((key, shader.clone()));
        }
        let composed = self.composer()?.compose(source, flags)?;
        gpu.take_error()?;
        let module = gpu.device().create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(source.path),
            source: wgpu::ShaderSource::Naga(std::borrow::Cow::Owned(composed.module.clone())),
        });
        gpu.take_error()?;
        let shader = Arc::new(Shader { path: source.path.to_owned(), composed, module });
        self.shaders.insert(key, shader.clone());
        Ok((key, shader))
    }

    pub fn compute(
        &mut self,
        gpu: &Gpu,
        label: &str,
        source: Source<'_>,
        entry: &str,
        flags: &Flags,
    ) -> Result<ComputePipeline, BuildError> {
        let clock = Instant::now();
        let (shader_key, shader) = self.shader(gpu, source, flags)?;
        let key = hash_of((shader_key, entry));
        if let Some(pipeline) = self.compute.get(&key) {
            self.statistics.cache_hits += 1;
            return Ok(pipeline.clone());
        }
        let reflection = self.reflect(gpu, &shader, &[entry], &[])?;
        let layout = pipeline_layout(gpu, label, &reflection);
        let raw = gpu.device().create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(label),
            layout: Some(&layout),
            module: &shader.module,
            entry_point: Some(entry),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        gpu.take_error()?;
        let point = shader.composed.module.entry_points.iter().find(|point| point.name == entry);
        let workgroup = point.map_or([1; 3], |point| point.workgroup_size);
        let pipeline = ComputePipeline { raw, reflection: Arc::new(reflection), workgroup };
        self.compute.insert(key, pipeline.clone());
        self.created(clock);
        Ok(pipeline)
    }

    pub fn raster(&mut self, gpu: &Gpu, description: &RasterDescription<'_>) -> Result<RasterPipeline, BuildError> {
        let clock = Instant::now();
        let (shader_key, shader) = self.shader(gpu, description.source, description.flags)?;
        let state = format!(
            "{:?} {:?} {:?} {:?} {:?}",
            description.vertex_buffers, description.targets, description.depth, description.primitive, description.layouts
        );
        let key = hash_of((shader_key, description.vertex_entry, description.fragment_entry, state));
        if let Some(pipeline) = self.raster.get(&key) {
            self.statistics.cache_hits += 1;
            return Ok(pipeline.clone());
        }
        let entries: Vec<&str> = std::iter::once(description.vertex_entry).chain(description.fragment_entry).collect();
        let reflection = self.reflect(gpu, &shader, &entries, description.layouts)?;
        let layout = pipeline_layout(gpu, description.label, &reflection);
        let raw = gpu.device().create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(description.label),
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: &shader.module,
                entry_point: Some(description.vertex_entry),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &description.vertex_buffers.iter().cloned().map(Some).collect::<Vec<_>>(),
            },
            primitive: description.primitive,
            depth_stencil: description.depth.clone(),
            multisample: wgpu::MultisampleState::default(),
            fragment: description.fragment_entry.map(|entry| wgpu::FragmentState {
                module: &shader.module,
                entry_point: Some(entry),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: description.targets,
            }),
            multiview_mask: None,
            cache: None,
        });
        gpu.take_error()?;
        let pipeline = RasterPipeline { raw, reflection: Arc::new(reflection) };
        self.raster.insert(key, pipeline.clone());
        self.created(clock);
        Ok(pipeline)
    }

    fn created(&mut self, clock: Instant) {
        self.statistics.created += 1;
        self.statistics.seconds += clock.elapsed().as_secs_f64();
    }

    fn reflect(
        &mut self,
        gpu: &Gpu,
        shader: &Shader,
        entries: &[&str],
        given: &[(u32, wgpu::BindGroupLayout)],
    ) -> Result<Reflection, BuildError> {
        let bindings = reflect_bindings(shader, entries)?;
        let mut layouts: BTreeMap<u32, wgpu::BindGroupLayout> = given.iter().cloned().collect();
        let groups = bindings.iter().filter(|binding| binding.kind.is_some()).map(|binding| binding.group).max();
        for group in 0..=groups.or(given.iter().map(|(group, _)| *group).max()).unwrap_or(0) {
            if layouts.contains_key(&group) {
                continue;
            }
            let mut found: Vec<wgpu::BindGroupLayoutEntry> = bindings
                .iter()
                .filter(|binding| binding.group == group)
                .filter_map(|binding| {
                    Some(wgpu::BindGroupLayoutEntry {
                        binding: binding.binding,
                        visibility: binding.visibility,
                        ty: binding.kind?,
                        count: None,
                    })
                })
                .collect();
            found.sort_by_key(|entry| entry.binding);
            layouts.insert(group, self.layout(gpu, found));
        }
        gpu.take_error()?;
        Ok(Reflection { shader: shader.path.clone(), entry: entries.join(", "), bindings, layouts })
    }

    /// Equal layouts are one object, so that bind groups fit every pipeline that declares the same.
    fn layout(&mut self, gpu: &Gpu, entries: Vec<wgpu::BindGroupLayoutEntry>) -> wgpu::BindGroupLayout {
        if let Some((_, layout)) = self.layouts.iter().find(|(known, _)| *known == entries) {
            return layout.clone();
        }
        let layout = gpu.device().create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries });
        self.layouts.push((entries, layout.clone()));
        layout
    }
}

fn pipeline_layout(gpu: &Gpu, label: &str, reflection: &Reflection) -> wgpu::PipelineLayout {
    let groups: Vec<Option<&wgpu::BindGroupLayout>> = reflection.layouts.values().map(Some).collect();
    gpu.device().create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(label),
        bind_group_layouts: &groups,
        immediate_size: 0,
    })
}

fn reflect_bindings(shader: &Shader, entries: &[&str]) -> Result<Vec<DeclaredBinding>, BuildError> {
    let (module, info) = (&shader.composed.module, &shader.composed.info);
    let mut points = Vec::new();
    for entry in entries {
        let Some(index) = module.entry_points.iter().position(|point| point.name == *entry) else {
            let names = module.entry_points.iter().map(|point| point.name.as_str()).collect::<Vec<_>>().join(", ");
            return Err(BuildError::Other(format!("shader `{}` has no entry point `{entry}`; it has {names}", shader.path)));
        };
        points.push((stage(module.entry_points[index].stage), info.get_entry_point(index)));
    }
    let mut bindings = Vec::new();
    for (handle, variable) in module.global_variables.iter() {
        let Some(place) = &variable.binding else { continue };
        let mut visibility = wgpu::ShaderStages::empty();
        let mut filtered = false;
        for (stage, point) in &points {
            if !point[handle].is_empty() {
                visibility |= *stage;
            }
            filtered |= point.sampling_set.iter().any(|key| key.image == handle);
        }
        let kind = if visibility.is_empty() { None } else { Some(binding_type(module, variable, filtered)?) };
        let name = variable.name.clone().unwrap_or_default();
        bindings.push(DeclaredBinding { name, group: place.group, binding: place.binding, kind, visibility });
    }
    Ok(bindings)
}

fn stage(stage: naga::ShaderStage) -> wgpu::ShaderStages {
    match stage {
        naga::ShaderStage::Vertex => wgpu::ShaderStages::VERTEX,
        naga::ShaderStage::Fragment => wgpu::ShaderStages::FRAGMENT,
        _ => wgpu::ShaderStages::COMPUTE,
    }
}

fn binding_type(module: &naga::Module, variable: &naga::GlobalVariable, filtered: bool) -> Result<wgpu::BindingType, BuildError> {
    use naga::{AddressSpace, ImageClass, ImageDimension, ScalarKind, TypeInner};
    let unsupported =
        || BuildError::Other(format!("binding `{}` is of a kind that passes cannot bind", variable.name.as_deref().unwrap_or_default()));
    let inner = &module.types[variable.ty].inner;
    let size = || {
        let mut layouter = naga::proc::Layouter::default();
        layouter.update(module.to_ctx()).ok()?;
        wgpu::BufferSize::new(u64::from(layouter[variable.ty].size))
    };
    let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: size() };
    Ok(match (variable.space, inner) {
        (AddressSpace::Uniform, _) => buffer(wgpu::BufferBindingType::Uniform),
        (AddressSpace::Storage { access }, _) => {
            buffer(wgpu::BufferBindingType::Storage { read_only: !access.contains(naga::StorageAccess::STORE) })
        }
        (_, TypeInner::Sampler { comparison: true }) => wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Comparison),
        (_, TypeInner::Sampler { comparison: false }) => wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering),
        (_, TypeInner::Image { dim, arrayed, class }) => {
            let view_dimension = match (dim, arrayed) {
                (ImageDimension::D1, _) => wgpu::TextureViewDimension::D1,
                (ImageDimension::D2, false) => wgpu::TextureViewDimension::D2,
                (ImageDimension::D2, true) => wgpu::TextureViewDimension::D2Array,
                (ImageDimension::D3, _) => wgpu::TextureViewDimension::D3,
                (ImageDimension::Cube, false) => wgpu::TextureViewDimension::Cube,
                (ImageDimension::Cube, true) => wgpu::TextureViewDimension::CubeArray,
            };
            match class {
                ImageClass::Sampled { kind, multi } => {
                    let sample_type = match kind {
                        ScalarKind::Sint => wgpu::TextureSampleType::Sint,
                        ScalarKind::Uint => wgpu::TextureSampleType::Uint,
                        _ => wgpu::TextureSampleType::Float { filterable: filtered },
                    };
                    wgpu::BindingType::Texture { sample_type, view_dimension, multisampled: *multi }
                }
                ImageClass::Depth { multi } => {
                    wgpu::BindingType::Texture { sample_type: wgpu::TextureSampleType::Depth, view_dimension, multisampled: *multi }
                }
                ImageClass::Storage { format, access } => wgpu::BindingType::StorageTexture {
                    access: match (access.contains(naga::StorageAccess::LOAD), access.contains(naga::StorageAccess::STORE)) {
                        (true, true) => wgpu::StorageTextureAccess::ReadWrite,
                        (true, false) => wgpu::StorageTextureAccess::ReadOnly,
                        _ => wgpu::StorageTextureAccess::WriteOnly,
                    },
                    format: storage_format(*format).ok_or_else(unsupported)?,
                    view_dimension,
                },
                ImageClass::External => return Err(unsupported()),
            }
        }
        _ => return Err(unsupported()),
    })
}

/// The storage formats of the WebGPU baseline.
fn storage_format(format: naga::StorageFormat) -> Option<wgpu::TextureFormat> {
    use naga::StorageFormat as From;
    use wgpu::TextureFormat as To;
    Some(match format {
        From::Rgba8Unorm => To::Rgba8Unorm,
        From::Rgba8Snorm => To::Rgba8Snorm,
        From::Rgba8Uint => To::Rgba8Uint,
        From::Rgba8Sint => To::Rgba8Sint,
        From::Rgba16Uint => To::Rgba16Uint,
        From::Rgba16Sint => To::Rgba16Sint,
        From::Rgba16Float => To::Rgba16Float,
        From::R32Uint => To::R32Uint,
        From::R32Sint => To::R32Sint,
        From::R32Float => To::R32Float,
        From::Rg32Uint => To::Rg32Uint,
        From::Rg32Sint => To::Rg32Sint,
        From::Rg32Float => To::Rg32Float,
        From::Rgba32Uint => To::Rgba32Uint,
        From::Rgba32Sint => To::Rgba32Sint,
        From::Rgba32Float => To::Rgba32Float,
        _ => return None,
    })
}

/// For [`crate::bindings`]: a pipeline lost between asking and answering is the device's fault.
pub(crate) fn checked<T>(gpu: &Gpu, made: T) -> Result<T, GpuError> {
    gpu.take_error().map(|()| made)
}
