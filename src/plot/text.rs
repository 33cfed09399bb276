//! Words → text between the tags of a drawing.

use std::fmt::{self, Display, Formatter, Write as _};

/// Text as SVG takes it.
pub struct Escaped<'a>(pub &'a str);

impl Display for Escaped<'_> {
    fn fmt(&self, out: &mut Formatter<'_>) -> fmt::Result {
        for letter in self.0.chars() {
            match letter {
                '&' => out.write_str("&amp;")?,
                '<' => out.write_str("&lt;")?,
                '>' => out.write_str("&gt;")?,
                // XML has no place for control characters, not even escaped.
                _ if letter.is_control() => out.write_char(' ')?,
                _ => out.write_char(letter)?,
            }
        }
        Ok(())
    }
}
