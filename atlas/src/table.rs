//! Tables of the atlas's page, and how they get there.

use crate::twin::{Report, Twin};
use std::fmt::Write as _;

/// A Markdown table of what was found for each twin.
pub fn twin_table(twins: &[Twin], reports: &[Report]) -> String {
    let mut table = String::from("| function | domain | rows | worst error | allowed there | at |\n|---|---|---:|---:|---:|---|\n");
    for (twin, report) in twins.iter().zip(reports) {
        let used = report.row.iter().rposition(|value| *value != 0.0).map_or(1, |last| last + 1);
        let inputs: Vec<String> = report.row[..used].iter().map(|value| short(f64::from(*value))).collect();
        // Writing to a string cannot fail.
        let _ = writeln!(
            table,
            "| `{}` | {} | {} | {:.1e} | {:.1e} | {} |",
            report.name,
            twin.domain.replace('|', "\\|"),
            report.rows,
            report.error,
            report.bound,
            inputs.join(" ")
        );
    }
    table
}

fn short(value: f64) -> String {
    if value == 0.0 || (1e-2..1e4).contains(&value.abs()) { format!("{}", (value * 1e3).round() / 1e3) } else { format!("{value:.1e}") }
}

/// A page without the place for a table.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
#[error("the page has no `<!-- {0}: begin -->` with a `<!-- {0}: end -->` after it")]
pub struct NoPlace(String);

/// Replaces what stands between `<!-- marker: begin -->` and `<!-- marker: end -->`.
pub fn replace_between(text: &str, marker: &str, body: &str) -> Result<String, NoPlace> {
    let (begin, end) = (format!("<!-- {marker}: begin -->"), format!("<!-- {marker}: end -->"));
    let none = || NoPlace(marker.to_owned());
    let (head, rest) = text.split_once(&begin).ok_or_else(none)?;
    let (_, tail) = rest.split_once(&end).ok_or_else(none)?;
    Ok(format!("{head}{begin}\n{}\n{end}{tail}", body.trim_end()))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_between_the_marks_is_replaced() {
        let page = "a\n<!-- t: begin -->\nold\n<!-- t: end -->\nb <!-- u: begin --><!-- u: end -->";
        let new = replace_between(page, "t", "new\n").unwrap();
        assert_eq!(new, "a\n<!-- t: begin -->\nnew\n<!-- t: end -->\nb <!-- u: begin --><!-- u: end -->");
        assert_eq!(replace_between(&new, "t", "new").unwrap(), new);
        assert_eq!(replace_between("<!-- t: end --><!-- t: begin -->", "t", "x"), Err(NoPlace("t".into())));
        assert!(replace_between(page, "v", "x").is_err());
    }
}
