//! naga_oil, and nothing else, stands behind [`Composer`].

use crate::error::{declared_names, find_word, original_column, place_of};
use crate::{FlagValue, Flags, ShaderError, Source};
use naga_oil::compose::{ComposableModuleDescriptor, ComposerError, ComposerErrorInner, NagaModuleDescriptor, ShaderDefValue};
use std::collections::HashMap;

/// A composed, validated shader.
#[derive(Clone, Debug)]
pub struct Composed {
    /// The module. Bindings, structures and entry points of the entry file keep their names, so shaders can be reflected by them; names of imported
    /// modules are decorated, which is one reason why modules hold no bindings.
    pub module: naga::Module,
    /// What validation found, among it which bindings an entry point uses.
    pub info: naga::valid::ModuleInfo,
}

/// Composes entry files with the modules that they import. What a module becomes under a set of flags is kept, so composing again is cheap.
pub struct Composer {
    inner: naga_oil::compose::Composer,
    modules: Vec<KnownModule>,
}

struct KnownModule {
    name: String,
    path: String,
    text: String,
    declared: Vec<String>,
}

impl Composer {
    /// A composer that knows the library's modules.
    pub fn new() -> Result<Self, ShaderError> {
        let inner = naga_oil::compose::Composer::default().with_capabilities(naga::valid::Capabilities::empty());
        let mut composer = Self { inner, modules: Vec::new() };
        for source in crate::modules() {
            composer.add_module(*source)?;
        }
        Ok(composer)
    }

    /// Adds a module, whose `#define_import_path` names it. Its own imports must have been added before. A module of the same name is replaced.
    ///
    /// Errors here are those of the preprocessor; what else is wrong with a module shows when an entry file first imports it.
    pub fn add_module(&mut self, source: Source<'_>) -> Result<(), ShaderError> {
        let descriptor = ComposableModuleDescriptor { source: source.text, file_path: source.path, ..Default::default() };
        let name = self.inner.add_composable_module(descriptor).map(|module| module.name.clone());
        match name {
            Ok(name) => {
                self.modules.retain(|module| module.name != name);
                let declared = declared_names(source.text);
                self.modules.push(KnownModule { name, path: source.path.to_owned(), text: source.text.to_owned(), declared });
                Ok(())
            }
            Err(error) => Err(self.describe(&error, source)),
        }
    }

    /// Composes an entry file under flags, and validates the result for a device without optional features.
    pub fn compose(&mut self, entry: Source<'_>, flags: &Flags) -> Result<Composed, ShaderError> {
        let defs: HashMap<String, ShaderDefValue> = flags
            .iter()
            .map(|(name, value)| {
                let value = match value {
                    FlagValue::Bool(value) => ShaderDefValue::Bool(value),
                    FlagValue::Int(value) => ShaderDefValue::Int(value),
                    FlagValue::Uint(value) => ShaderDefValue::UInt(value),
                };
                (name.to_owned(), value)
            })
            .collect();
        let descriptor = NagaModuleDescriptor { source: entry.text, file_path: entry.path, shader_defs: defs, ..Default::default() };
        let module = match self.inner.make_naga_module(descriptor) {
            Ok(module) => module,
            Err(error) => return Err(self.describe(&error, entry)),
        };
        // naga_oil has validated the module to place errors in its sources, but keeps what validation found.
        let mut validator = naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::empty());
        match validator.validate(&module) {
            Ok(info) => Ok(Composed { module, info }),
            Err(error) => Err(ShaderError::new(entry.path, entry.text, (1, 1), error.emit_to_string(entry.text), None)),
        }
    }

    /// `source` is what was being added or composed; the error may lie in a module that it imports.
    fn describe(&self, error: &ComposerError, source: Source<'_>) -> ShaderError {
        let path = error.source.path(&self.inner).as_str();
        let module = self.modules.iter().find(|module| module.path == path && path != source.path);
        let text = module.map_or(source.text, |module| module.text.as_str());
        let report = Report::read(&error.emit_to_string(&self.inner), path);

        if let ComposerErrorInner::ImportNotFound(name, _) = &error.inner {
            // naga_oil points at the first use of the name.
            let place = find_word(text, name, |line| line.trim_start().starts_with("#import")).or(report.place).unwrap_or((1, 1));
            let help = self.nearest_module(name).map(|near| format!("did you mean `{near}`?"));
            return ShaderError::new(path, text, place, format!("there is no module `{name}`"), help);
        }

        let place = match (preprocessor_offset(&error.inner), report.place) {
            (Some(offset), _) => Some(place_of(text, offset)),
            (None, Some((line, column))) => {
                // What naga saw, in which imported names are decorated and so longer.
                let composed = error.source.source(&self.inner);
                let line_of = |text: &str| text.lines().nth(line.saturating_sub(1)).unwrap_or_default().to_owned();
                Some((line, original_column(&line_of(text), &line_of(&composed), column)))
            }
            (None, None) => match &error.inner {
                ComposerErrorInner::ShaderValidationError(error) | ComposerErrorInner::HeaderValidationError(error) => {
                    match error.as_inner() {
                        naga::valid::ValidationError::EntryPoint { name, .. } => find_word(text, name, |line| line.contains("fn ")),
                        _ => None,
                    }
                }
                _ => None,
            },
        };
        let help = unknown_name(&report.message).and_then(|name| self.nearest_item(name));
        ShaderError::new(path, text, place.unwrap_or((1, 1)), report.message, help)
    }

    fn nearest_module(&self, name: &str) -> Option<&str> {
        if let Some((_, item)) = name.rsplit_once("::")
            && let Some(module) = self.modules.iter().find(|module| module.declared.iter().any(|declared| declared == item))
        {
            return Some(&module.name);
        }
        nearest(last(name), self.modules.iter().map(|module| module.name.as_str()))
    }

    /// A hint for a name that nothing in scope has: `lobelia::math::luminanc`, or `luminance` without an import.
    fn nearest_item(&self, name: &str) -> Option<String> {
        match name.rsplit_once("::") {
            Some((module, item)) => {
                let module = self.modules.iter().find(|known| known.name == module)?;
                let near = nearest(item, module.declared.iter().map(String::as_str))?;
                Some(format!("did you mean `{}::{near}`?", module.name))
            }
            None => {
                let module = self.modules.iter().find(|module| module.declared.iter().any(|declared| declared == name))?;
                Some(format!("`#import {}::{name}` provides it", module.name))
            }
        }
    }
}

/// Where in the text as written the preprocessor stopped; in what it hands on, such places do not exist.
fn preprocessor_offset(error: &ComposerErrorInner) -> Option<usize> {
    use ComposerErrorInner as Inner;
    match error {
        Inner::NotEnoughEndIfs(offset)
        | Inner::TooManyEndIfs(offset)
        | Inner::ElseWithoutCondition(offset)
        | Inner::DefineInModule(offset)
        | Inner::UnknownShaderDef { pos: offset, .. }
        | Inner::UnknownShaderDefOperator { pos: offset, .. }
        | Inner::InvalidShaderDefComparisonValue { pos: offset, .. }
        | Inner::InvalidShaderDefDefinitionValue { pos: offset, .. }
        | Inner::InvalidWgslDirective { position: offset, .. } => Some(*offset),
        _ => None,
    }
}

fn last(path: &str) -> &str {
    path.rsplit("::").next().unwrap_or(path)
}

/// As [`lobelia_base::nearest`], over the last parts of paths.
fn nearest<'a>(name: &str, candidates: impl Iterator<Item = &'a str> + Clone) -> Option<&'a str> {
    let near = lobelia_base::nearest(name, candidates.clone().map(last))?;
    candidates.into_iter().find(|candidate| last(candidate) == near)
}

/// The name in naga's "no definition in scope for identifier: `NAME`".
fn unknown_name(message: &str) -> Option<&str> {
    let (_, rest) = message.split_once("no definition in scope for identifier: `")?;
    rest.split_once('`').map(|(name, _)| name)
}

/// naga_oil's rendered diagnostic, the only place where it says with undecorated names what is wrong and where.
struct Report {
    message: String,
    place: Option<(usize, usize)>,
}

impl Report {
    fn read(rendered: &str, path: &str) -> Self {
        let mut lines = rendered.lines();
        let first = lines.next().unwrap_or_default();
        let headline = first.strip_prefix("error: ").or_else(|| first.strip_prefix(path)).unwrap_or(first).trim_start_matches(": ");
        let mut message = headline.to_owned();
        let mut place = None;
        for line in lines {
            if let Some(note) = line.trim_start().strip_prefix("= ") {
                if !message.contains(note) {
                    message = format!("{message}: {note}");
                }
            } else if place.is_none() && line.trim_start().starts_with('┌') {
                place = line.rsplit_once(&format!("{path}:")).and_then(|(_, numbers)| {
                    let (line, column) = numbers.trim_end().split_once(':')?;
                    Some((line.parse().ok()?, column.parse().ok()?))
                });
            }
        }
        Self { message, place }
    }
}
