//! Text in columns.

/// Rows of cells under a line of heads; numbers to the right, words to the left.
pub struct Table {
    rows: Vec<Vec<String>>,
}

impl Table {
    pub fn new<const N: usize>(heads: [&str; N]) -> Self {
        Table::with_heads(heads.map(String::from).to_vec())
    }

    /// A table whose columns are known only as it is made.
    pub fn with_heads(heads: Vec<String>) -> Self {
        Table { rows: vec![heads] }
    }

    pub fn row<const N: usize>(&mut self, cells: [String; N]) {
        self.wide_row(cells.to_vec());
    }

    /// A row of as many cells as there are heads.
    pub fn wide_row(&mut self, cells: Vec<String>) {
        self.rows.push(cells);
    }

    /// The heads, then every row.
    pub fn rows(&self) -> &[Vec<String>] {
        &self.rows
    }

    /// Whether a column holds words: its cells do not begin like numbers.
    pub fn is_of_words(&self, column: usize) -> bool {
        let mut cells =
            self.rows[1..].iter().filter_map(|row| row.get(column)).filter(|cell| !cell.is_empty());
        let is_word = |cell: &String| cell.starts_with(char::is_alphabetic);
        cells.next().is_some_and(is_word) && cells.all(is_word)
    }

    /// The lines, without a line break after the last.
    pub fn lines(&self) -> String {
        let columns = self.rows[0].len();
        let widths: Vec<usize> = (0..columns)
            .map(|i| self.rows.iter().filter_map(|row| row.get(i)).map(|cell| cell.chars().count()).max())
            .map(Option::unwrap_or_default)
            .collect();
        let aligned = |row: &Vec<String>| {
            let cells = row.iter().zip(&widths).enumerate().map(|(i, (cell, &width))| {
                if self.is_of_words(i) { format!("{cell:<width$}") } else { format!("{cell:>width$}") }
            });
            cells.collect::<Vec<_>>().join("  ").trim_end().to_string()
        };
        self.rows.iter().map(aligned).collect::<Vec<_>>().join("\n")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_stand_left_and_numbers_right() {
        let mut table = Table::new(["level", "kind", "bytes"]);
        table.row(["0".into(), "base".into(), "7".into()]);
        table.row(["10".into(), "adaptive".into(), "1234567".into()]);
        table.row([String::new(), String::new(), "9".into()]);
        let lines = [
            "level  kind        bytes",
            "    0  base            7",
            "   10  adaptive  1234567",
            "                       9",
        ];
        assert_eq!(table.lines(), lines.join("\n"));
    }
}
