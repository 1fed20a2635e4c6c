//! The registry: every pass that a graph file may name, and the bridge from the typed [`Pass`] to what the plan and the run can hold.

use crate::{
    error::{BuildError, PortError, RunError},
    gpu::Gpu,
    params::{ParamInfo, ParamProblem, Params},
    pass::{CreateContext, InputShapes, Need, Pass, PlanContext, Specialisation, World},
    ports::{AnyShape, PortInfo, PortValue, Ports},
    run::Frame,
};
use lobelia_base::nearest;
use lobelia_shaders::Flags;
use std::{any::Any, fmt::Debug, marker::PhantomData, sync::Arc};

/// Everything that can be said of a pass type without a graph.
#[derive(Clone, Debug)]
pub struct PassInfo {
    /// [`Pass::NAME`].
    pub name: &'static str,
    /// [`Pass::DOC`].
    pub doc: &'static str,
    /// Input ports.
    pub inputs: Vec<PortInfo>,
    /// Output ports.
    pub outputs: Vec<PortInfo>,
    /// Parameters.
    pub params: Vec<ParamInfo>,
}

/// The passes that graph files may name, in the order they were added.
pub struct Registry<W: World> {
    kinds: Vec<Arc<dyn Kind<W>>>,
}

impl<W: World> Default for Registry<W> {
    fn default() -> Self {
        Self::new()
    }
}

impl<W: World> Registry<W> {
    /// An empty registry.
    pub fn new() -> Self {
        Self { kinds: Vec::new() }
    }

    /// Adds a pass. A pass of the same name that was added before is replaced, so that a host can put its own in the place of a built-in one.
    pub fn add<P: Pass<World = W>>(&mut self) -> &mut Self {
        let kind = Arc::new(Registered::<P> {
            info: PassInfo {
                name: P::NAME,
                doc: P::DOC,
                inputs: P::Inputs::infos(),
                outputs: P::Outputs::infos(),
                params: P::Params::infos(),
            },
            pass: PhantomData,
        });
        match self.kinds.iter_mut().find(|existing| existing.info().name == P::NAME) {
            Some(existing) => *existing = kind,
            None => self.kinds.push(kind),
        }
        self
    }

    /// Describes every pass.
    pub fn infos(&self) -> impl Iterator<Item = &PassInfo> {
        self.kinds.iter().map(|kind| kind.info())
    }

    /// Finds a pass by its name; `_` and `-` are the same.
    pub fn info(&self, name: &str) -> Option<&PassInfo> {
        self.find(name).map(|kind| kind.info())
    }

    /// The registered name closest to `name`, if one is close.
    pub fn nearest(&self, name: &str) -> Option<&'static str> {
        nearest(&canonical(name), self.infos().map(|info| info.name))
    }

    /// What every pass that states a claim would add to a picture of a scene, with its defaults.
    pub fn claims(&self, traits: &W::Traits) -> Vec<(&'static str, W::Claim)> {
        let claim = |kind: &Arc<dyn Kind<W>>| Some((kind.info().name, kind.claim(kind.parse("()").ok()?.as_ref(), traits)?));
        self.kinds.iter().filter_map(claim).collect()
    }

    pub(crate) fn find(&self, name: &str) -> Option<&Arc<dyn Kind<W>>> {
        let name = canonical(name);
        self.kinds.iter().find(|kind| kind.info().name == name)
    }
}

/// RON identifiers cannot hold `-`, so files write `vpl_lights` for `vpl-lights`.
pub(crate) fn canonical(name: &str) -> String {
    name.replace('_', "-")
}

/// Parameters whose type has been forgotten.
pub(crate) trait AnyParams: Any + Send + Sync + Debug {
    fn as_any(&self) -> &dyn Any;
    fn boxed_clone(&self) -> Box<dyn AnyParams>;
    fn to_ron(&self) -> String;
    fn to_json(&self) -> serde_json::Value;
}

impl<P: Params> AnyParams for P {
    fn as_any(&self) -> &dyn Any {
        self
    }
    fn boxed_clone(&self) -> Box<dyn AnyParams> {
        Box::new(self.clone())
    }
    fn to_ron(&self) -> String {
        crate::params::ron_text(self)
    }
    fn to_json(&self) -> serde_json::Value {
        serde_json::to_value(self).unwrap_or_default()
    }
}

/// What planning hands to a pass whose type it has forgotten.
pub(crate) struct ErasedPlanContext<'a, W: World> {
    pub name: &'a str,
    pub params: &'a dyn AnyParams,
    pub traits: &'a W::Traits,
    pub extent: [u32; 2],
}

/// What running hands to a pass whose type it has forgotten.
pub(crate) struct ErasedContext<'a, W: World> {
    pub plan: ErasedPlanContext<'a, W>,
    pub gpu: &'a Gpu,
    pub world: &'a W::Device,
    pub flags: &'a Flags,
    pub inputs: &'a [PortValue],
    pub outputs: &'a [PortValue],
}

/// A registered pass type.
pub(crate) trait Kind<W: World>: 'static {
    fn info(&self) -> &PassInfo;
    fn parse(&self, ron: &str) -> Result<Box<dyn AnyParams>, ron::error::SpannedError>;
    fn problems(&self, params: &dyn AnyParams) -> Vec<ParamProblem>;
    fn need(&self, params: &dyn AnyParams, traits: &W::Traits) -> Need;
    fn claim(&self, params: &dyn AnyParams, traits: &W::Traits) -> Option<W::Claim>;
    fn specialise(&self, context: &ErasedPlanContext<'_, W>, inputs: &[PortValue]) -> Vec<Specialisation>;
    fn shape(&self, context: &ErasedPlanContext<'_, W>, inputs: &[PortValue]) -> Result<Vec<Vec<Box<dyn AnyShape>>>, PortError>;
    fn warnings(&self, context: &ErasedPlanContext<'_, W>, inputs: &[PortValue]) -> Vec<String>;
    fn create(&self, context: &ErasedContext<'_, W>) -> Result<Box<dyn AnyPass<W>>, BuildError>;
}

/// A created pass.
pub(crate) trait AnyPass<W: World> {
    fn bind(&self, context: &ErasedContext<'_, W>) -> Result<Box<dyn Any>, BuildError>;
    fn record(&mut self, frame: &mut Frame<'_>, world: &W::Device, bindings: &dyn Any) -> Result<(), RunError>;
}

struct Registered<P: Pass> {
    info: PassInfo,
    pass: PhantomData<fn() -> P>,
}

impl<P: Pass> Registered<P> {
    /// A kind only ever meets parameters that it parsed itself.
    fn params<'a>(&self, params: &'a dyn AnyParams) -> &'a P::Params {
        params.as_any().downcast_ref().unwrap_or_else(|| unreachable!("parameters of another pass reached `{}`", P::NAME))
    }

    fn inputs(&self, values: &[PortValue]) -> Result<InputShapes<P>, PortError> {
        P::Inputs::shapes(values).ok_or_else(|| PortError::new("a required input has no producer"))
    }

    fn plan_context<'a>(&self, context: &ErasedPlanContext<'a, P::World>) -> PlanContext<'a, P> {
        PlanContext { name: context.name, params: self.params(context.params), traits: context.traits, extent: context.extent }
    }
}

fn with_create_context<P: Pass, T>(
    context: &ErasedContext<'_, P::World>,
    use_it: impl FnOnce(&CreateContext<'_, P>) -> Result<T, BuildError>,
) -> Result<T, BuildError> {
    let missing = |what: &str| BuildError::Other(format!("{what} of `{}` are incomplete", context.plan.name));
    let params = context.plan.params.as_any().downcast_ref().ok_or_else(|| missing("parameters"))?;
    let inputs = P::Inputs::shapes(context.inputs).ok_or_else(|| missing("inputs"))?;
    let outputs = P::Outputs::shapes(context.outputs).ok_or_else(|| missing("outputs"))?;
    use_it(&CreateContext {
        name: context.plan.name,
        params,
        traits: context.plan.traits,
        extent: context.plan.extent,
        gpu: context.gpu,
        world: context.world,
        flags: context.flags,
        inputs: &inputs,
        outputs: &outputs,
    })
}

impl<P: Pass> Kind<P::World> for Registered<P> {
    fn info(&self) -> &PassInfo {
        &self.info
    }

    fn parse(&self, ron: &str) -> Result<Box<dyn AnyParams>, ron::error::SpannedError> {
        let params: P::Params = crate::file::ron_options().from_str(ron)?;
        Ok(Box::new(params))
    }

    fn problems(&self, params: &dyn AnyParams) -> Vec<ParamProblem> {
        self.params(params).problems()
    }

    fn need(&self, params: &dyn AnyParams, traits: &<P::World as World>::Traits) -> Need {
        P::need(self.params(params), traits)
    }

    fn claim(&self, params: &dyn AnyParams, traits: &<P::World as World>::Traits) -> Option<<P::World as World>::Claim> {
        P::claim(self.params(params), traits)
    }

    fn specialise(&self, context: &ErasedPlanContext<'_, P::World>, inputs: &[PortValue]) -> Vec<Specialisation> {
        match self.inputs(inputs) {
            Ok(inputs) => P::specialise(&self.plan_context(context), &inputs),
            Err(_) => Vec::new(),
        }
    }

    fn shape(&self, context: &ErasedPlanContext<'_, P::World>, inputs: &[PortValue]) -> Result<Vec<Vec<Box<dyn AnyShape>>>, PortError> {
        let shapes = P::shape(&self.plan_context(context), &self.inputs(inputs)?)?;
        Ok(P::Outputs::erase(&shapes))
    }

    fn warnings(&self, context: &ErasedPlanContext<'_, P::World>, inputs: &[PortValue]) -> Vec<String> {
        self.inputs(inputs).map_or_else(|_| Vec::new(), |inputs| P::warnings(&self.plan_context(context), &inputs))
    }

    fn create(&self, context: &ErasedContext<'_, P::World>) -> Result<Box<dyn AnyPass<P::World>>, BuildError> {
        let pass = with_create_context::<P, _>(context, P::create)?;
        Ok(Box::new(Created(pass)))
    }
}

struct Created<P: Pass>(P);

impl<P: Pass> AnyPass<P::World> for Created<P> {
    fn bind(&self, context: &ErasedContext<'_, P::World>) -> Result<Box<dyn Any>, BuildError> {
        let missing = || BuildError::Other(format!("ports of `{}` are incomplete", context.plan.name));
        let inputs = P::Inputs::assemble(context.inputs).ok_or_else(missing)?;
        let outputs = P::Outputs::assemble(context.outputs).ok_or_else(missing)?;
        with_create_context::<P, _>(context, |typed| Ok(Box::new(self.0.bind(typed, &inputs, &outputs)?) as Box<dyn Any>))
    }

    fn record(&mut self, frame: &mut Frame<'_>, world: &<P::World as World>::Device, bindings: &dyn Any) -> Result<(), RunError> {
        let Some(bindings) = bindings.downcast_ref::<P::Bindings>() else {
            return Err(RunError::Pass { pass: frame.pass_name().to_owned(), message: "bindings of another pass".into() });
        };
        self.0.record(frame, world, bindings)
    }
}
