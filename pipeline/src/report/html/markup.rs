// SPDX-License-Identifier: MIT OR Apache-2.0
//! Text that goes into HTML, and the template that it goes into.

use std::borrow::Cow;

use anyhow::{Result, bail};
use serde_json::Value;

/// `text` where HTML expects text, or the value of an attribute in double quotes.
pub fn escaped(text: &str) -> Cow<'_, str> {
    if !text.contains(['&', '<', '>', '"', '\'']) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len() + 16);
    for letter in text.chars() {
        match letter {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            other => out.push(other),
        }
    }
    Cow::Owned(out)
}

/// `value` as JSON that may stand within a `script` element: nothing in it can end the element or begin a comment.
pub fn script_json(value: &Value) -> String {
    value.to_string().replace('<', "\\u003c")
}

/// `template` with every `{{name}}` replaced by what `parts` has under that name; what is put in is not looked at again.
///
/// # Errors
/// A name that `parts` lacks, or one of `parts` that the template does not use.
pub fn filled(template: &str, parts: &[(&str, String)]) -> Result<String> {
    let mut out = String::with_capacity(
        template.len() + parts.iter().map(|(_, text)| text.len()).sum::<usize>(),
    );
    let mut used = vec![false; parts.len()];
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        let Some((name, after)) = after.split_once("}}") else {
            bail!("template: expected }}}} after {{{{");
        };
        let Some(part) = parts.iter().position(|(known, _)| *known == name) else {
            bail!("template: nothing known under {name}");
        };
        used[part] = true;
        out.push_str(before);
        out.push_str(&parts[part].1);
        rest = after;
    }
    out.push_str(rest);
    if let Some(part) = used.iter().position(|used| !used) {
        bail!("template: expected a place for {}", parts[part].0);
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn no_text_can_leave_its_place() {
        assert_eq!(escaped("plain µ"), "plain µ");
        assert_eq!(
            escaped("\"><script>a && 'b'</script>"),
            "&quot;&gt;&lt;script&gt;a &amp;&amp; &#39;b&#39;&lt;/script&gt;"
        );
        let json = json!({"</script><!--": "</SCRIPT>"});
        let text = script_json(&json);
        assert!(!text.contains('<'), "{text}");
        assert_eq!(serde_json::from_str::<Value>(&text).unwrap(), json);
    }

    #[test]
    fn what_is_put_in_is_not_a_template() {
        let parts = [("a", "{{b}}".to_owned()), ("b", "2".to_owned())];
        assert_eq!(filled("<{{a}}|{{b}}>", &parts).unwrap(), "<{{b}}|2>");
        assert!(filled("{{a}}", &parts).is_err());
        assert!(filled("{{a}}{{b}}{{c}}", &parts).is_err());
        assert_eq!(filled("{{b}}{{a}}{{b}}", &parts).unwrap(), "2{{b}}2");
        assert!(filled("{{a", &parts).is_err());
    }
}
