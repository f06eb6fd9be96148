//! What all pages share: their frame, their style, and tables.

use std::fmt::Write as _;

/// The style of every page.
const STYLE: &str = include_str!("assets/style.css");

/// A page without scripts: a title, a line below it, and what `body` holds, which is HTML.
///
/// It loads nothing, and no script runs in it.
#[must_use]
pub fn sheet(title: &str, line: &str, body: &str) -> String {
    let title = escaped(title);
    let nonce = nonce(body);
    let policy = policy(&nonce, false);
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n{policy}\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{title}</title>\n\
         <style nonce=\"{nonce}\">\n{STYLE}</style>\n</head>\n<body class=\"sheet\">\n<header class=\"top\"><div><h1>{title}</h1>\
         <p class=\"line\">{}</p></div></header>\n<main>\n{body}</main>\n</body>\n</html>\n",
        escaped(line)
    )
}

/// The style as it stands in a page.
pub(super) fn style() -> &'static str {
    STYLE
}

/// A word that what is of the page itself is marked with; equal pages have equal ones.
pub(super) fn nonce(text: &str) -> String {
    blake3::hash(text.as_bytes()).to_hex()[..24].to_owned()
}

/// What a browser may load: nothing, and run: what is marked.
pub(super) fn policy(nonce: &str, scripts: bool) -> String {
    let script = if scripts {
        format!(" script-src 'nonce-{nonce}';")
    } else {
        String::new()
    };
    format!(
        "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; style-src 'nonce-{nonce}';{script} \
         base-uri 'none'; form-action 'none'\">\n"
    )
}

/// A table with a title, in a card of its own; cells are HTML.
#[must_use]
pub fn table(title: &str, head: &[&str], rows: &[Vec<String>]) -> String {
    let cells = |tag: &str, cells: &mut dyn Iterator<Item = &str>| -> String {
        cells.map(|c| format!("<{tag}>{c}</{tag}>")).collect()
    };
    let mut html = format!(
        "<section class=\"card\"><h2>{title}</h2>\n<div class=\"wide\"><table>\n<thead><tr>{}</tr></thead>\n<tbody>\n",
        cells("th", &mut head.iter().copied())
    );
    for row in rows {
        // Writing to a string does not fail.
        let _ = writeln!(
            html,
            "<tr>{}</tr>",
            cells("td", &mut row.iter().map(String::as_str))
        );
    }
    html + "</tbody>\n</table></div></section>\n"
}

/// A word that says whether all is well.
#[must_use]
pub fn mark(good: bool) -> String {
    let (class, text) = if good { ("ok", "yes") } else { ("bad", "no") };
    format!("<span class=\"{class}\">{text}</span>")
}

/// A picture in the page itself; `about` says what it shows to who does not see it.
#[must_use]
pub fn picture(png: &[u8], about: &str) -> String {
    let digits = crate::io::base64::text(png);
    format!(
        "<img alt=\"{}\" src=\"data:image/png;base64,{}\">",
        escaped(about),
        String::from_utf8_lossy(&digits)
    )
}

/// Text that means nothing to HTML. Characters that turn the direction of writing are shown by their numbers.
#[must_use]
pub fn escaped(text: &str) -> String {
    let mut html = String::with_capacity(text.len() + 8);
    for c in text.chars() {
        match c {
            '&' => html.push_str("&amp;"),
            '<' => html.push_str("&lt;"),
            '>' => html.push_str("&gt;"),
            '"' => html.push_str("&quot;"),
            '\'' => html.push_str("&#39;"),
            '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' => {
                html.extend(c.escape_unicode());
            }
            c if c.is_control() && !matches!(c, '\n' | '\t') => html.extend(c.escape_unicode()),
            c => html.push(c),
        }
    }
    html
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_text() {
        assert_eq!(escaped("<b>&\"x\"'"), "&lt;b&gt;&amp;&quot;x&quot;&#39;");
        assert_eq!(escaped("a\u{202e}b\u{1}ü"), "a\\u{202e}b\\u{1}ü");
        let page = sheet("</title><script>", "a < b", &table("t", &["h"], &[]));
        assert!(!page.contains("<script") && page.contains("&lt;/title&gt;"));
    }
}
