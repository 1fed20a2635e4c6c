//! naga_oil, and nothing else, stands behind [`Composer`].

use crate::{FlagValue, Flags, Source};
use naga_oil::compose::{ComposableModuleDescriptor, ComposerError, ComposerErrorInner, NagaModuleDescriptor, ShaderDefValue};
use std::collections::HashMap;

/// A shader is wrong.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{path}:{line}:{column}: {message}{}\n{detail}", .help.as_ref().map(|help| format!("; {help}")).unwrap_or_default())]
pub struct ShaderError {
    /// Path of the WGSL text at fault.
    pub path: String,
    /// Line, from 1.
    pub line: usize,
    /// Column, from 1.
    pub column: usize,
    /// What is wrong.
    pub message: String,
    /// How to mend it.
    pub help: Option<String>,
    /// The lines of the text, with marks.
    pub detail: String,
}

/// A composed, validated shader.
#[derive(Clone, Debug)]
pub struct Composed {
    /// The module. Bindings and entry points of the entry file keep their names.
    pub module: naga::Module,
    /// What validation found, among it which bindings an entry point uses.
    pub info: naga::valid::ModuleInfo,
}

/// Composes entry files with the modules that they import.
pub struct Composer {
    inner: naga_oil::compose::Composer,
    names: Vec<String>,
}

impl Composer {
    /// A composer that knows the library's modules.
    pub fn new() -> Result<Self, ShaderError> {
        let inner = naga_oil::compose::Composer::default().with_capabilities(naga::valid::Capabilities::empty());
        let mut composer = Self { inner, names: Vec::new() };
        for source in crate::modules() {
            composer.add_module(*source)?;
        }
        Ok(composer)
    }

    /// Adds a module, whose `#define_import_path` names it. Its own imports must have been added before.
    pub fn add_module(&mut self, source: Source<'_>) -> Result<(), ShaderError> {
        let descriptor = ComposableModuleDescriptor { source: source.text, file_path: source.path, ..Default::default() };
        let name = self.inner.add_composable_module(descriptor).map(|module| module.name.clone());
        match name {
            Ok(name) => {
                self.names.push(name);
                Ok(())
            }
            Err(error) => Err(self.describe(&error)),
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
            Err(error) => return Err(self.describe(&error)),
        };
        let mut validator = naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::empty());
        match validator.validate(&module) {
            Ok(info) => Ok(Composed { module, info }),
            Err(error) => Err(ShaderError {
                path: entry.path.to_owned(),
                line: 1,
                column: 1,
                message: error.as_inner().to_string(),
                help: None,
                detail: format!("{error:?}"),
            }),
        }
    }

    fn describe(&self, error: &ComposerError) -> ShaderError {
        let detail = without_colours(&error.emit_to_string(&self.inner));
        let path = error.source.path(&self.inner).clone();
        let (line, column) = place(&detail, &path).unwrap_or((1, 1));
        let help = match &error.inner {
            ComposerErrorInner::ImportNotFound(name, _) => self.nearest(name).map(|near| format!("did you mean `{near}`?")),
            _ => None,
        };
        ShaderError { path, line, column, message: error.inner.to_string(), help, detail }
    }

    /// The module whose name shares the longest beginning or end with `name`.
    fn nearest(&self, name: &str) -> Option<&str> {
        let likeness = |candidate: &str| {
            let same = |left: &mut dyn Iterator<Item = char>, right: &mut dyn Iterator<Item = char>| {
                left.zip(right).take_while(|(l, r)| l == r).count()
            };
            let last = candidate.rsplit("::").next().unwrap_or(candidate);
            let wanted = name.rsplit("::").next().unwrap_or(name);
            same(&mut last.chars(), &mut wanted.chars()).max(same(&mut last.chars().rev(), &mut wanted.chars().rev()))
        };
        self.names
            .iter()
            .map(|candidate| (likeness(candidate), candidate.as_str()))
            .filter(|(score, _)| *score > 1)
            .max()
            .map(|(_, name)| name)
    }
}

/// Finds `path:line:column` in a rendered diagnostic.
fn place(detail: &str, path: &str) -> Option<(usize, usize)> {
    let start = detail.find(&format!("{path}:"))? + path.len() + 1;
    let mut numbers = detail[start..].split(|c: char| !c.is_ascii_digit()).filter_map(|number| number.parse().ok());
    Some((numbers.next()?, numbers.next()?))
}

fn without_colours(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    let mut escaped = false;
    for character in text.chars() {
        match character {
            '\u{1b}' => escaped = true,
            'm' if escaped => escaped = false,
            _ if escaped => {}
            other => plain.push(other),
        }
    }
    plain
}
