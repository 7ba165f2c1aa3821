//! Values from the text of an override, and units written where none belong.

use toml::Value;

use super::keys::Kind;

/// Key and text of `key=value`.
pub(super) fn split(text: &str) -> Option<(&str, &str)> {
    let (key, value) = text.split_once('=')?;
    let (key, value) = (key.trim(), value.trim());
    (!key.is_empty() && !value.is_empty()).then_some((key, value))
}

/// The value that `text` stands for where a key takes `kind`: TOML, but words need
/// no quotes and lists of numbers no brackets. What is neither stays text, for the
/// check of its kind to refuse.
pub(super) fn value(kind: Kind, text: &str) -> Value {
    let as_text = || Value::String(text.trim_matches('"').to_owned());
    match kind {
        Kind::Word(_) => as_text(),
        Kind::Numbers(_) if !text.starts_with('[') => {
            toml_value(&format!("[{text}]")).unwrap_or_else(as_text)
        }
        Kind::Number => {
            toml_value(text).or_else(|| text.parse().ok().map(Value::Float)).unwrap_or_else(as_text)
        }
        _ => toml_value(text).unwrap_or_else(as_text),
    }
}

fn toml_value(text: &str) -> Option<Value> {
    toml::from_str::<toml::Table>(&format!("v = {text}")).ok()?.remove("v")
}

/// Whether `text` is a number with a unit behind it.
pub(super) fn has_unit(text: &str) -> bool {
    let text = text.trim();
    let number = (1..=text.len())
        .rev()
        .filter(|&end| text.is_char_boundary(end))
        .find(|&end| text[..end].trim_end().parse::<f64>().is_ok());
    number.is_some_and(|end| {
        text[end..]
            .trim_start()
            .starts_with(|c: char| c.is_alphabetic() || matches!(c, '%' | '°' | '/'))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_told_from_other_text() {
        for text in ["0.1s", "5mm/s", "5 mm/s", "3 %", "1e-3 s", "-2N", "0.5°", "12µm"] {
            assert!(has_unit(text), "{text}");
        }
        for text in ["abc", "", "1,5", "1 2", "0.1", "s"] {
            assert!(!has_unit(text), "{text}");
        }
    }

    #[test]
    fn words_need_no_quotes_and_lists_no_brackets() {
        assert_eq!(value(Kind::Word(&[]), "retract"), Value::String("retract".into()));
        assert_eq!(value(Kind::Word(&[]), "\"retract\""), Value::String("retract".into()));
        assert_eq!(
            value(Kind::Numbers(3), "18, 40.5"),
            Value::Array(vec![Value::Integer(18), Value::Float(40.5)])
        );
        assert_eq!(value(Kind::Numbers(3), "[18]"), Value::Array(vec![Value::Integer(18)]));
        assert_eq!(value(Kind::Number, ".5"), Value::Float(0.5));
        assert_eq!(value(Kind::Number, "0.1s"), Value::String("0.1s".into()));
    }

    #[test]
    fn an_assignment_has_a_key_and_a_value() {
        assert_eq!(split(" a.b = 1 "), Some(("a.b", "1")));
        for text in ["a.b", "=1", "a.b=", ""] {
            assert_eq!(split(text), None, "{text}");
        }
    }
}
