//! What a shader author reads when a shader is wrong.

/// A shader is wrong.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{path}:{line}:{column}: {message}{}\n{detail}", .help.as_ref().map(|help| format!("; {help}")).unwrap_or_default())]
pub struct ShaderError {
    /// Path of the WGSL text at fault.
    pub path: String,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// What is wrong.
    pub message: String,
    /// How to mend it.
    pub help: Option<String>,
    /// The line of the text, with a mark under the column.
    pub detail: String,
}

impl ShaderError {
    pub(crate) fn new(path: &str, text: &str, (line, column): (usize, usize), message: String, help: Option<String>) -> Self {
        let written = text.lines().nth(line.saturating_sub(1)).unwrap_or_default().trim_end();
        let margin = line.to_string();
        // Tabs stay tabs, so that the mark stands right at any tab width.
        let indent: String = written
            .chars()
            .map(|c| if c == '\t' { '\t' } else { ' ' })
            .chain(std::iter::repeat(' '))
            .take(column.saturating_sub(1))
            .collect();
        let detail = format!("{margin} | {written}\n{} | {indent}^", " ".repeat(margin.len()));
        Self { path: path.to_owned(), line, column, message, help, detail }
    }
}

/// Names that a module declares for others.
pub(crate) fn declared_names(text: &str) -> Vec<String> {
    text.lines()
        .filter_map(|line| ["fn ", "const ", "struct ", "alias "].iter().find_map(|keyword| line.strip_prefix(keyword)))
        .map(|rest| rest.chars().take_while(|c| is_word(*c)).collect())
        .collect()
}

/// Line and column of a whole word in the lines that `wanted` picks.
pub(crate) fn find_word(text: &str, word: &str, wanted: impl Fn(&str) -> bool) -> Option<(usize, usize)> {
    text.lines().enumerate().filter(|(_, line)| wanted(line)).find_map(|(index, line)| {
        line.match_indices(word)
            .find(|(start, _)| {
                let before = line[..*start].chars().next_back();
                let after = line[start + word.len()..].chars().next();
                !before.is_some_and(is_word) && !after.is_some_and(is_word)
            })
            .map(|(start, _)| (index + 1, line[..start].chars().count() + 1))
    })
}

/// Line and column of a byte of the text; past its end, those of the end.
pub(crate) fn place_of(text: &str, offset: usize) -> (usize, usize) {
    let before = String::from_utf8_lossy(&text.as_bytes()[..offset.min(text.len())]).into_owned();
    let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
    (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
}

/// The column of `original` that corresponds to a column of the same line after imported names, or paths of names, were replaced by longer ones:
/// word by word both lines are alike.
pub(crate) fn original_column(original: &str, composed: &str, column: usize) -> usize {
    let (written, replaced) = (words(original), words(composed));
    let place = column.saturating_sub(1);
    if written.len() != replaced.len() {
        return column;
    }
    match replaced.iter().position(|(start, length)| (*start..start + length).contains(&place)) {
        Some(index) => {
            let (start, length) = written[index];
            start + (place - replaced[index].0).min(length - 1) + 1
        }
        None => column,
    }
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// Start and length, in characters, of every word (a path `a::b` is one), and of every other character by itself.
fn words(line: &str) -> Vec<(usize, usize)> {
    let characters: Vec<char> = line.chars().collect();
    let mut found = Vec::new();
    let mut start = 0;
    while start < characters.len() {
        let mut end = start;
        while end < characters.len() {
            if is_word(characters[end]) {
                end += 1;
            } else if end > start && characters[end..].starts_with(&[':', ':']) {
                end += 2;
            } else {
                break;
            }
        }
        let length = (end - start).max(1);
        found.push((start, length));
        start += length;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_survive_longer_names() {
        let original = "    let x = math::PI + missing(1.0);";
        let composed = "    let x = PIX_naga_oil_mod_XYZX + missing(1.0);";
        let column = |text: &str| text.find("missing").map_or(0, |start| start + 1);
        assert_eq!(original_column(original, composed, column(composed)), column(original));
        // Inside a replaced name, the place stays within what was written.
        assert_eq!(original_column("f(PI)", "f(PIX_naga_oil_mod_XYZX)", 12), 4);
        // Where nothing was replaced, nothing moves; past the end neither.
        assert_eq!(original_column("let a = b;", "let a = b;", 9), 9);
        assert_eq!(original_column("a", "a", 7), 7);
    }

    #[test]
    fn places_are_counted_in_lines_and_characters() {
        assert_eq!(place_of("ab\ncé d", 0), (1, 1));
        assert_eq!(place_of("ab\ncé d", 2), (1, 3));
        assert_eq!(place_of("ab\ncé d", 7), (2, 4));
        assert_eq!(place_of("ab\n", 99), (2, 1));
    }

    #[test]
    fn words_are_found_whole() {
        let text = "// PI\nlet PIN = 1;\nlet a = PI;\n";
        assert_eq!(find_word(text, "PI", |line| !line.starts_with("//")), Some((3, 9)));
        assert_eq!(find_word(text, "TAU", |_| true), None);
    }
}
