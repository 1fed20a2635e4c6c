//! The graph file: RON with places remembered.
//!
//! The file is read in layers. Each layer takes apart one level of the text and keeps what is inside as raw RON, so that every name and value
//! still knows its place when a later stage finds fault with it.

use crate::problem::{Problem, Problems, position};
use lobelia_files::NoText;
use ron::value::RawValue;
use serde::{
    Deserialize, Deserializer,
    de::{MapAccess, SeqAccess, Visitor},
};
use std::{fmt, ops::Range, path::Path};

/// A piece of text and where it stands in the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Spanned {
    /// The text.
    pub text: String,
    /// Its bytes in the file.
    pub span: Range<usize>,
}

/// One pass of a file, not yet understood.
#[derive(Clone, Debug)]
pub struct PassEntry {
    /// Name in this graph.
    pub name: Spanned,
    /// Registered name, as written.
    pub kind: Spanned,
    /// Parameters: name, and value as RON text.
    pub params: Vec<(Spanned, Spanned)>,
    /// Explicit wiring: input port and `pass.port` texts.
    pub from: Vec<(Spanned, Vec<Spanned>)>,
    /// Whether a variant has taken it out.
    pub(crate) removed: bool,
}

/// What a variant puts in the place of a pass.
#[derive(Clone, Debug)]
pub enum Replacement {
    /// Another pass.
    Pass(PassEntry),
    /// Nothing: the pass is taken out.
    Remove(Spanned),
}

impl Replacement {
    /// Name of the pass that is replaced.
    pub fn name(&self) -> &Spanned {
        match self {
            Replacement::Pass(entry) => &entry.name,
            Replacement::Remove(name) => name,
        }
    }
}

/// A graph file, taken apart but not yet checked against a registry.
#[derive(Clone, Debug)]
pub struct GraphFile {
    /// Path, as given.
    pub path: String,
    /// Whole text.
    pub text: String,
    /// Passes in the order of the file.
    pub passes: Vec<PassEntry>,
    /// `pass.port` of what the graph makes.
    pub output: Spanned,
    /// Variants in the order of the file.
    pub variants: Vec<(Spanned, Vec<Replacement>)>,
    /// What is wrong with it as it is written, where the rest can still be read: told with whatever else is wrong when the graph is wired.
    pub(crate) faults: Vec<Problem>,
    /// Names of passes that could not be read; what follows from that is not told.
    pub(crate) unread: Vec<String>,
}

/// RON as graph files use it: `Some` need not be written.
pub(crate) fn ron_options() -> ron::Options {
    ron::Options::default().with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME)
}

/// Names and raw values of a RON struct or map, duplicates kept.
struct Entries<'a>(Vec<(String, &'a RawValue)>);

impl<'de> Deserialize<'de> for Entries<'de> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct EntriesVisitor;
        impl<'de> Visitor<'de> for EntriesVisitor {
            type Value = Entries<'de>;
            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str("named values, such as (size: 256) or {\"name\": value}")
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut entries = Vec::new();
                while let Some(name) = map.next_key::<String>()? {
                    entries.push((name, map.next_value::<&RawValue>()?));
                }
                Ok(Entries(entries))
            }
            fn visit_unit<E>(self) -> Result<Self::Value, E> {
                Ok(Entries(Vec::new()))
            }
        }
        deserializer.deserialize_any(EntriesVisitor)
    }
}

/// The raw values of a RON list.
struct Items<'a>(Vec<&'a RawValue>);

impl<'de> Deserialize<'de> for Items<'de> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct ItemsVisitor;
        impl<'de> Visitor<'de> for ItemsVisitor {
            type Value = Items<'de>;
            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str("a list")
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<Self::Value, A::Error> {
                let mut items = Vec::new();
                while let Some(item) = sequence.next_element::<&RawValue>()? {
                    items.push(item);
                }
                Ok(Items(items))
            }
        }
        deserializer.deserialize_seq(ItemsVisitor)
    }
}

/// The reader of one file: turns slices of its text back into places.
struct Reader<'a> {
    text: &'a str,
    problems: Vec<Problem>,
    /// Names of passes that could not be read.
    unread: Vec<String>,
}

impl<'a> Reader<'a> {
    /// The place of a slice of the file's text.
    fn span(&self, slice: &str) -> Range<usize> {
        let start = (slice.as_ptr() as usize).saturating_sub(self.text.as_ptr() as usize).min(self.text.len());
        start..(start + slice.len()).min(self.text.len())
    }

    fn raw(&self, value: &'a RawValue) -> Spanned {
        let text = value.trim().get_ron();
        Spanned { text: text.to_owned(), span: self.span(text) }
    }

    /// The place of the name that stands before `value`.
    fn name_before(&self, name: &str, value: &'a RawValue) -> Spanned {
        let start = self.span(value.get_ron()).start;
        let span = self.text[..start].rfind(name).map_or(start..start, |found| found..found + name.len());
        Spanned { text: name.to_owned(), span }
    }

    /// Reads a slice of the file; a syntax error is reported at its place in the whole file.
    fn read<T: Deserialize<'a>>(&mut self, slice: &'a str) -> Option<T> {
        match ron_options().from_str::<T>(slice) {
            Ok(value) => Some(value),
            Err(error) => {
                let base = self.span(slice).start;
                self.problems.push(syntax_problem(slice, base, &error));
                None
            }
        }
    }

    /// Named values with their places; duplicate names are reported, and the first counts.
    fn entries(&mut self, slice: &'a str, what: &str) -> Vec<(Spanned, &'a RawValue)> {
        let Some(Entries(entries)) = self.read::<Entries<'a>>(slice) else { return Vec::new() };
        let named: Vec<_> = entries.into_iter().map(|(name, value)| (self.name_before(&name, value), value)).collect();
        for (index, (name, _)) in named.iter().enumerate() {
            if let Some((first, _)) = named[..index].iter().find(|(earlier, _)| earlier.text == name.text) {
                self.problems.push(
                    Problem::at(name.span.clone(), format!("duplicate {what} `{}`", name.text))
                        .other(first.span.clone(), "first written here"),
                );
            }
        }
        let mut seen = std::collections::HashSet::new();
        named.into_iter().filter(|(name, _)| seen.insert(name.text.clone())).collect()
    }

    /// A name that `pass.port` and `pass.param=value` could not tell from what follows it is refused.
    fn check_pass_name(&mut self, name: &Spanned) {
        let what = if name.text.trim().is_empty() {
            "a pass needs a name".to_owned()
        } else if name.text.contains(['.', '=']) {
            format!("a pass cannot be called `{}`: `.` and `=` end a name", name.text)
        } else {
            return;
        };
        self.problems.push(Problem::at(name.span.clone(), what));
    }

    /// `kind(param: value, ..., from: {...})`.
    fn pass(&mut self, name: Spanned, value: &'a RawValue) -> Option<PassEntry> {
        let text = value.trim().get_ron();
        let kind_end = text.find(|c: char| !(c.is_alphanumeric() || "_-#".contains(c))).unwrap_or(text.len());
        let kind_text = text[..kind_end].trim_start_matches("r#");
        if kind_text.is_empty() {
            let help = "write the kind of pass before its parameters: \"name\": gbuffer(...)";
            self.problems.push(Problem::at(self.span(text), format!("pass `{}` has no kind", name.text)).help(help));
            self.unread.push(name.text);
            return None;
        }
        let kind = Spanned { text: kind_text.to_owned(), span: self.span(&text[..kind_end]) };
        let body = text[kind_end..].trim();
        let mut entry = PassEntry { name, kind, params: Vec::new(), from: Vec::new(), removed: false };
        if body.is_empty() {
            return Some(entry);
        }
        for (name, value) in self.entries(body, "parameter") {
            if name.text == "from" {
                entry.from = self.from(value);
            } else {
                entry.params.push((name, self.raw(value)));
            }
        }
        Some(entry)
    }

    /// `{"port": "pass.port", "other": ["a.b", "c.d"]}`, or the same in parentheses.
    fn from(&mut self, value: &'a RawValue) -> Vec<(Spanned, Vec<Spanned>)> {
        let mut wires = Vec::new();
        for (port, value) in self.entries(value.trim().get_ron(), "port") {
            let text = value.trim().get_ron();
            let items: Vec<&'a str> = if text.starts_with('[') {
                self.read::<Items<'a>>(text)
                    .map_or_else(Vec::new, |Items(items)| items.into_iter().map(|item| item.trim().get_ron()).collect())
            } else if text == "none" {
                Vec::new()
            } else {
                vec![text]
            };
            let sources = items.into_iter().filter_map(|item| self.string(item)).collect();
            wires.push((port, sources));
        }
        wires
    }

    fn string(&mut self, slice: &'a str) -> Option<Spanned> {
        self.read::<String>(slice).map(|text| Spanned { text, span: self.span(slice) })
    }
}

/// Says in place what the RON reader found wrong.
pub(crate) fn syntax_problem(slice: &str, base: usize, error: &ron::error::SpannedError) -> Problem {
    let at = |place: ron::error::Position| base + offset_of(slice, place.line, place.col);
    let (start, end) = (at(error.span.start), at(error.span.end));
    let end = end.max(start);
    let message = match error.code {
        ron::Error::ExceededRecursionLimit => "brackets are nested too deeply".to_owned(),
        ref code => code.to_string(),
    };
    Problem::at(start..end, message)
}

/// Byte offset of a line and column, both from 1, columns in characters.
fn offset_of(text: &str, line: usize, column: usize) -> usize {
    let start = if line <= 1 { 0 } else { text.match_indices('\n').nth(line - 2).map_or(text.len(), |(index, _)| index + 1) };
    text[start..].char_indices().nth(column.saturating_sub(1)).map_or(text.len(), |(index, _)| start + index)
}

impl GraphFile {
    /// Reads and takes apart a file.
    pub fn load(path: &Path) -> Result<Self, Problems> {
        let shown = path.display().to_string();
        let unreadable = |what: String| Problems {
            file: shown.clone(),
            text: String::new(),
            problems: vec![Problem::on_command_line(format!("{shown}: cannot read the graph: {what}"))],
        };
        let bytes = std::fs::read(path).map_err(|error| unreadable(error.to_string()))?;
        match lobelia_files::text(&bytes) {
            Ok(text) => Self::parse(text, &shown),
            Err(NoText::NotUtf8 { valid_up_to }) => Err(Problems {
                text: String::from_utf8_lossy(lobelia_files::without_mark(&bytes)).into_owned(),
                problems: vec![Problem::at(valid_up_to..valid_up_to, "a graph is UTF-8 text, but this byte is not")],
                file: shown,
            }),
            Err(NoText::Other(what)) => Err(unreadable(what)),
        }
    }

    /// Takes apart `text`; `path` is only shown. Where passes and output can be told, what else is wrong waits for [`GraphFile::wire`] or [`GraphFile::check`], which
    /// tell all mistakes of the file at once.
    pub fn parse(text: &str, path: &str) -> Result<Self, Problems> {
        let mut reader = Reader { text, problems: Vec::new(), unread: Vec::new() };
        let mut passes = Vec::new();
        let mut output = None;
        let mut variants = Vec::new();
        let mut seen_passes = false;
        for (name, value) in reader.entries(text, "section") {
            match name.text.as_str() {
                "passes" => {
                    seen_passes = true;
                    for (pass, value) in reader.entries(value.trim().get_ron(), "pass") {
                        reader.check_pass_name(&pass);
                        passes.extend(reader.pass(pass, value));
                    }
                }
                "output" => output = reader.string(value.trim().get_ron()),
                "variants" => {
                    for (variant, value) in reader.entries(value.trim().get_ron(), "variant") {
                        let mut replacements = Vec::new();
                        for (pass, value) in reader.entries(value.trim().get_ron(), "pass") {
                            if value.trim().get_ron() == "none" {
                                replacements.push(Replacement::Remove(pass));
                            } else {
                                replacements.extend(reader.pass(pass, value).map(Replacement::Pass));
                            }
                        }
                        variants.push((variant, replacements));
                    }
                }
                other => {
                    let near = lobelia_base::nearest(other, ["passes", "output", "variants"]);
                    reader.problems.push(
                        Problem::at(
                            name.span.clone(),
                            format!("a graph has no section `{other}`; it has `passes`, `output` and `variants`"),
                        )
                        .maybe_help(near.map(|near| format!("did you mean `{near}`?"))),
                    );
                }
            }
        }
        if reader.problems.is_empty() && !seen_passes {
            reader.problems.push(Problem::at(0..0, "the graph has no `passes`"));
        }
        if reader.problems.is_empty() && output.is_none() {
            let help = "add `output: \"pass.port\"` after the passes";
            reader.problems.push(Problem::at(0..0, "the graph does not say what its `output` is").help(help));
        }
        let Reader { problems, unread, .. } = reader;
        match output {
            Some(output) if seen_passes => {
                Ok(Self { path: path.to_owned(), text: text.to_owned(), passes, output, variants, faults: problems, unread })
            }
            _ => Err(Problems { file: path.to_owned(), text: text.to_owned(), problems }),
        }
    }

    /// Line and column, both from 1, of a byte offset.
    pub fn position(&self, offset: usize) -> (usize, usize) {
        position(&self.text, offset)
    }

    /// Names of the variants, in the order of the file.
    pub fn variant_names(&self) -> impl Iterator<Item = &str> {
        self.variants.iter().map(|(name, _)| name.text.as_str())
    }

    pub(crate) fn fail(&self, problems: Vec<Problem>) -> Problems {
        Problems { file: self.path.clone(), text: self.text.clone(), problems }
    }
}
