//! Small pieces of HTML. Every text from outside goes through [`escape`].

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::Serialize;

use crate::data::{Measurement, Picture, Time};

/// Text for an element or for an attribute in quotes.
pub(crate) fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            letter => escaped.push(letter),
        }
    }
    escaped
}

/// `template` with each `{{name}}` replaced by its value, in one pass: braces inside a value are left alone.
pub(crate) fn fill(template: &str, values: &[(&str, &str)]) -> String {
    let mut filled = String::with_capacity(template.len() + values.iter().map(|(_, value)| value.len()).sum::<usize>());
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        filled.push_str(before);
        let Some((name, after)) = after.split_once("}}") else {
            filled.push_str("{{");
            rest = after;
            continue;
        };
        if let Some((_, value)) = values.iter().find(|(key, _)| *key == name) {
            filled.push_str(value);
        }
        rest = after;
    }
    filled.push_str(rest);
    filled
}

/// JSON for the inside of a script element, where `<` must not occur: `</script>` and `<!--` would end or change the element.
pub(crate) fn json<T: Serialize>(value: &T) -> String {
    match serde_json::to_string(value) {
        Ok(text) => text.replace('<', "\\u003c").replace('>', "\\u003e").replace('&', "\\u0026"),
        Err(_) => "null".to_owned(),
    }
}

pub(crate) fn data_uri(picture: &Picture) -> String {
    base64(&picture.png)
}

/// A PNG file as an address.
pub(crate) fn base64(png: &[u8]) -> String {
    format!("data:image/png;base64,{}", STANDARD.encode(png))
}

/// Bytes as mebibytes.
pub(crate) fn mebibytes(bytes: u64) -> f64 {
    bytes as f64 / f64::from(1u32 << 20)
}

/// The value of a parameter, as a graph would have it.
pub(crate) fn parameter(value: &serde_json::Value) -> String {
    match value {
        serde_json::Value::String(text) => text.clone(),
        serde_json::Value::Null => "none".to_owned(),
        // Single floats: their shortest digits, not those of the double that holds them.
        serde_json::Value::Number(number) if number.is_f64() => {
            number.as_f64().map_or_else(|| number.to_string(), |value| format!("{}", value as f32))
        }
        other => other.to_string(),
    }
}

/// Parameters of a pass as (name, value); empty where it has none.
pub(crate) fn parameters(value: &serde_json::Value) -> Vec<(String, String)> {
    value.as_object().into_iter().flatten().map(|(name, value)| (name.clone(), parameter(value))).collect()
}

/// Three significant digits, plain where that is readable; "not a number" and "infinite" in words.
pub(crate) fn number(value: f64) -> String {
    if value.is_nan() {
        return "not a number".to_owned();
    }
    if value.is_infinite() {
        return if value > 0.0 { "infinite".to_owned() } else { "−infinite".to_owned() };
    }
    let size = value.abs();
    let text = if size == 0.0 {
        "0".to_owned()
    } else if (99.95..1e6).contains(&size) {
        format!("{value:.0}")
    } else if (9.995..1e6).contains(&size) {
        format!("{value:.1}")
    } else if (0.9995..1e6).contains(&size) {
        format!("{value:.2}")
    } else if (1e-3..1.0).contains(&size) {
        let digits = 2 - size.log10().floor() as i32;
        format!("{value:.*}", digits.max(0) as usize)
    } else {
        let text = format!("{value:.2e}");
        match text.split_once('e') {
            Some((digits, exponent)) => format!("{digits}·10{}", raised(exponent)),
            None => text,
        }
    };
    text.replace('-', "−")
}

/// Digits and signs of an exponent, raised.
pub(crate) fn raised(exponent: &str) -> String {
    let raise = |letter: char| match letter {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        digit @ '4'..='9' => char::from_u32(u32::from('⁴') + u32::from(digit) - u32::from('4')).unwrap_or(digit),
        _ => '⁰',
    };
    exponent.chars().map(raise).collect()
}

/// `number` with its unit, or only the words where it is not finite.
pub(crate) fn with_unit(value: f64, unit: &str) -> String {
    if value.is_finite() { format!("{} {unit}", number(value)) } else { number(value) }
}

/// `value (low to high)`; the value alone where its interval is not known or is a point.
pub(crate) fn value_with_interval(found: &Measurement) -> String {
    match interval(found.low, found.high) {
        Some(interval) => format!("{} ({interval})", number(found.value)),
        None => number(found.value),
    }
}

/// `low to high`; none where that is not known or is a point.
pub(crate) fn interval(low: Option<f64>, high: Option<f64>) -> Option<String> {
    let (low, high) = low.zip(high)?;
    // Digits enough to tell both ends apart.
    let (mut a, mut b) = (number(low), number(high));
    if a == b && low != high {
        (a, b) = (format!("{low:.5}").replace('-', "−"), format!("{high:.5}").replace('-', "−"));
    }
    (a != b).then(|| format!("{a} to {b}"))
}

/// A time with its unit and its interval.
pub(crate) fn time_with_interval(time: &Time) -> String {
    match interval(time.low, time.high) {
        Some(interval) => format!("{} ({interval})", with_unit(time.median, "ms")),
        None => with_unit(time.median, "ms"),
    }
}

/// A fraction as percent with its sign.
pub(crate) fn signed_percent(fraction: f64) -> String {
    if !fraction.is_finite() {
        return "not defined".to_owned();
    }
    let text = number(fraction * 100.0);
    if fraction > 0.0 { format!("+{text} %") } else { format!("{text} %") }
}

/// Pairs as a definition list.
pub(crate) fn definitions(pairs: &[(String, String)]) -> String {
    if pairs.is_empty() {
        return "<p class=\"quiet\">none</p>".to_owned();
    }
    let items: String =
        pairs.iter().map(|(name, value)| format!("<div><dt>{}</dt><dd>{}</dd></div>", escape(name), escape(value))).collect();
    format!("<dl class=\"facts\">{items}</dl>")
}

/// Pairs in one line: `name value, name value`.
pub(crate) fn pairs_line(pairs: &[(String, String)]) -> String {
    if pairs.is_empty() {
        return "no parameters".to_owned();
    }
    pairs.iter().map(|(name, value)| format!("{name} {value}")).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::{escape, fill, json, number, signed_percent};

    #[test]
    fn text_cannot_leave_its_place() {
        assert_eq!(escape("<a b=\"c\" d='e'>&"), "&lt;a b=&quot;c&quot; d=&#39;e&#39;&gt;&amp;");
        let text = json(&"</script><!--");
        assert!(!text.contains('<') && !text.contains('>'));
        assert_eq!(serde_json::from_str::<String>(&text).expect("the text is JSON"), "</script><!--");
    }

    #[test]
    fn a_value_with_braces_is_not_filled_again() {
        assert_eq!(fill("{{a}} {{b}} {{", &[("a", "{{b}}"), ("b", "x")]), "{{b}} x {{");
    }

    #[test]
    fn numbers_keep_three_digits() {
        let cases = [
            (0.0, "0"),
            (1.0, "1.00"),
            (12.345, "12.3"),
            (1234.5, "1234"),
            (0.01234, "0.0123"),
            (-0.5, "−0.500"),
            (1.2e-5, "1.20·10⁻⁵"),
            (3.4e7, "3.40·10⁷"),
            (f64::NAN, "not a number"),
            (f64::INFINITY, "infinite"),
        ];
        for (value, text) in cases {
            assert_eq!(number(value), text);
        }
        assert_eq!(signed_percent(0.25), "+25.0 %");
        assert_eq!(signed_percent(f64::INFINITY), "not defined");
    }
}
