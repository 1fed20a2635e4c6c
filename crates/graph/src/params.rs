//! Parameters of a pass: plain data with serde, a default, and ranges that are checked before anything runs.
//!
//! ```ignore
//! #[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Params)]
//! #[serde(default, deny_unknown_fields)]
//! pub struct Params {
//!     /// Side of each square map.
//!     #[param(unit = "texels", range = 16..=4096)]
//!     pub resolution: u32,
//! }
//! impl Default for Params { fn default() -> Self { Self { resolution: 512 } } }
//! ```
//!
//! The derive reads documentation, unit and range off the struct, so that `lobelia passes NAME` and the checks speak from one source.

use serde::{Deserialize, Deserializer, Serialize, Serializer, de::DeserializeOwned};
use std::fmt;

/// One parameter, described.
#[derive(Clone, Debug, PartialEq)]
pub struct ParamInfo {
    /// Field name, as it is written in a graph file.
    pub name: &'static str,
    /// Field documentation.
    pub doc: &'static str,
    /// Rust type, or the choices of an enumeration.
    pub kind: String,
    /// Unit; empty where it has none.
    pub unit: &'static str,
    /// Valid range; empty where any value of the type is valid.
    pub range: String,
    /// Default value as it would be written in RON.
    pub default: String,
}

/// A parameter out of its range.
#[derive(Clone, Debug, PartialEq)]
pub struct ParamProblem {
    /// Which one.
    pub name: &'static str,
    /// What was found and what is valid.
    pub message: String,
}

/// Parameters of a pass. Derive it.
pub trait Params: Clone + Default + Serialize + DeserializeOwned + fmt::Debug + PartialEq + Send + Sync + 'static {
    /// Describes every parameter, in field order.
    fn infos() -> Vec<ParamInfo>;
    /// Everything that is out of range. NaN is out of every range.
    fn problems(&self) -> Vec<ParamProblem>;
}

/// For passes without parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct NoParams {}

impl Params for NoParams {
    fn infos() -> Vec<ParamInfo> {
        Vec::new()
    }
    fn problems(&self) -> Vec<ParamProblem> {
        Vec::new()
    }
}

/// A type that a parameter can have: what it is called, and whether a value lies in a numeric range.
pub trait ParamValue: Serialize {
    /// Name of the type in help texts: `integer`, `number`, `true or false`, or the choices of an enumeration.
    fn kind() -> String;
    /// The numbers in it that a range applies to.
    fn numbers(&self) -> Vec<f64> {
        Vec::new()
    }
}

macro_rules! numeric_param {
    ($kind:literal: $($type:ty),*) => {$(
        impl ParamValue for $type {
            fn kind() -> String {
                $kind.into()
            }
            fn numbers(&self) -> Vec<f64> {
                vec![*self as f64]
            }
        }
    )*};
}
numeric_param!("integer": u8, u16, u32, u64, usize, i32, i64);
numeric_param!("number": f32, f64);

impl ParamValue for bool {
    fn kind() -> String {
        "true or false".into()
    }
}

impl ParamValue for String {
    fn kind() -> String {
        "text".into()
    }
}

impl<T: ParamValue, const N: usize> ParamValue for [T; N]
where
    [T; N]: Serialize,
{
    fn kind() -> String {
        format!("{N} of {}", T::kind())
    }
    fn numbers(&self) -> Vec<f64> {
        self.iter().flat_map(ParamValue::numbers).collect()
    }
}

/// A number, or the word `none` that switches something off: `clamp: 10.0` or `clamp: none`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum OrNone<T> {
    /// Switched off.
    None,
    /// Switched on with this value.
    Value(T),
}

impl<T> OrNone<T> {
    /// The value, if there is one.
    pub fn value(self) -> Option<T> {
        match self {
            OrNone::None => None,
            OrNone::Value(value) => Some(value),
        }
    }
}

impl<T: Serialize> Serialize for OrNone<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            OrNone::None => serializer.serialize_unit_variant("OrNone", 0, "none"),
            OrNone::Value(value) => value.serialize(serializer),
        }
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for OrNone<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        enum Word {
            #[serde(rename = "none", alias = "None")]
            None,
        }
        #[derive(Deserialize)]
        #[serde(untagged, expecting = "expected a number or the word `none`")]
        enum Written<T> {
            Value(T),
            Word(Word),
        }
        Ok(match Written::<T>::deserialize(deserializer)? {
            Written::Value(value) => OrNone::Value(value),
            Written::Word(Word::None) => OrNone::None,
        })
    }
}

impl<T: ParamValue> ParamValue for OrNone<T> {
    fn kind() -> String {
        format!("{} or none", T::kind())
    }
    fn numbers(&self) -> Vec<f64> {
        match self {
            OrNone::None => Vec::new(),
            OrNone::Value(value) => value.numbers(),
        }
    }
}

/// Checks one field; called by the derive.
pub fn check_range<T: ParamValue>(name: &'static str, value: &T, low: f64, high: f64, shown: &str) -> Option<ParamProblem> {
    let bad = value.numbers().into_iter().find(|number| !(*number >= low && *number <= high))?;
    Some(ParamProblem { name, message: format!("`{name}` is {bad}, but must lie in {shown}") })
}

/// Checks that the numbers of a field without a range are finite; called by the derive.
pub fn check_finite<T: ParamValue>(name: &'static str, value: &T) -> Option<ParamProblem> {
    let bad = value.numbers().into_iter().find(|number| !number.is_finite())?;
    Some(ParamProblem { name, message: format!("`{name}` is {bad}, but must be finite") })
}

/// Text of a value as RON; called by the derive.
pub fn ron_text<T: Serialize>(value: &T) -> String {
    ron::to_string(value).unwrap_or_else(|error| format!("<{error}>"))
}
