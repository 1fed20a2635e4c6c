//! What specialises a shader.

use std::collections::BTreeMap;

/// Value of a flag.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum FlagValue {
    /// For `#ifdef` and `#if NAME == true`.
    Bool(bool),
    /// For `#if` and `#{NAME}`.
    Int(i32),
    /// For `#if` and `#{NAME}u`.
    Uint(u32),
}

impl From<bool> for FlagValue {
    fn from(value: bool) -> Self {
        FlagValue::Bool(value)
    }
}

impl From<i32> for FlagValue {
    fn from(value: i32) -> Self {
        FlagValue::Int(value)
    }
}

impl From<u32> for FlagValue {
    fn from(value: u32) -> Self {
        FlagValue::Uint(value)
    }
}

/// A set of named flags. A flag that is `false` is left undefined, so `#ifdef NAME` asks whether it is on.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Flags(BTreeMap<String, FlagValue>);

impl Flags {
    /// No flags.
    pub fn new() -> Self {
        Self::default()
    }

    /// Sets a flag; `false` takes it away.
    pub fn set(&mut self, name: &str, value: impl Into<FlagValue>) -> &mut Self {
        match value.into() {
            FlagValue::Bool(false) => self.0.remove(name),
            value => self.0.insert(name.to_owned(), value),
        };
        self
    }

    /// As [`Flags::set`], by value.
    pub fn with(mut self, name: &str, value: impl Into<FlagValue>) -> Self {
        self.set(name, value);
        self
    }

    /// Whether a flag is defined.
    pub fn has(&self, name: &str) -> bool {
        self.0.contains_key(name)
    }

    /// All flags that are defined, by name.
    pub fn iter(&self) -> impl Iterator<Item = (&str, FlagValue)> {
        self.0.iter().map(|(name, value)| (name.as_str(), *value))
    }
}
