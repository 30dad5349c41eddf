//! One HTML page that holds everything that it shows: pictures, tables and plots in it, light or dark as
//! the reader likes, nothing from elsewhere.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;

use crate::markup::escaped;
use crate::plot::Plot;
use crate::table::Table;

const STYLE: &str = include_str!("style.css");

/// A page that grows from its top.
pub struct Page {
    title: String,
    body: String,
}

/// A picture with a line below it.
pub struct Figure {
    pub png: Vec<u8>,
    /// In pixels.
    pub size: crate::picture::Size,
    pub caption: String,
}

impl Page {
    pub fn new(title: &str) -> Self {
        Page { title: escaped(title), body: format!("<h1>{}</h1>\n", escaped(title)) }
    }

    pub fn heading(&mut self, text: &str) {
        self.body += &format!("<h2>{}</h2>\n", escaped(text));
    }

    pub fn paragraph(&mut self, text: &str) {
        self.body += &format!("<p>{}</p>\n", escaped(text));
    }

    /// Pictures side by side, as many as the width allows.
    pub fn figures(&mut self, figures: &[Figure]) {
        self.body += "<div class=\"figures\">\n";
        for Figure { png, size, caption } in figures {
            let (data, caption) = (BASE64_STANDARD.encode(png), escaped(caption));
            self.body += &format!(
                "<figure><img width=\"{}\" height=\"{}\" alt=\"{caption}\" src=\"data:image/png;base64,{data}\">\
                 <figcaption>{caption}</figcaption></figure>\n",
                size.width, size.height
            );
        }
        self.body += "</div>\n";
    }

    pub fn table(&mut self, table: &Table) {
        self.body += "<div class=\"wide\"><table>\n";
        for (i, row) in table.rows().iter().enumerate() {
            let tag = if i == 0 { "th" } else { "td" };
            let cells = row.iter().enumerate().map(|(column, cell)| {
                let class = if table.is_of_words(column) { " class=\"words\"" } else { "" };
                format!("<{tag}{class}>{}</{tag}>", escaped(cell))
            });
            self.body += &format!("<tr>{}</tr>\n", cells.collect::<String>());
        }
        self.body += "</table></div>\n";
    }

    pub fn plot(&mut self, plot: &Plot) {
        self.body += &format!("<figure class=\"plot\">{}</figure>\n", plot.svg());
    }

    /// The whole page.
    pub fn html(&self) -> String {
        format!(
            "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width\">\n<title>{}</title>\n\
             <style>\n{STYLE}</style>\n<body>\n{}</body>\n</html>\n",
            self.title, self.body
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_cannot_break_out_of_the_page() {
        let mut page = Page::new("<script>&\"");
        let mut table = Table::new(["a<b"]);
        table.row(["</td>".into()]);
        page.table(&table);
        let html = page.html();
        assert!(html.contains("&lt;script&gt;&amp;&quot;") && html.contains("&lt;/td&gt;"), "{html}");
        assert!(!html.contains("<script>"), "{html}");
    }

    #[test]
    fn pictures_are_in_the_page() {
        let mut page = Page::new("a page");
        let size = crate::picture::Size { width: 3, height: 2 };
        page.figures(&[Figure { png: b"png".to_vec(), size, caption: "what it shows".into() }]);
        let html = page.html();
        assert!(html.contains("src=\"data:image/png;base64,cG5n\""), "{html}");
        assert!(html.contains("<figcaption>what it shows</figcaption>"), "{html}");
        assert!(!html.contains("http"), "{html}");
    }
}
