//! SVG → PNG.

use anyhow::{Context, anyhow};
use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree};

/// Draws a document with so many dots of width, in the fonts that the system has.
pub fn of_svg(svg: &str, width: u32) -> anyhow::Result<Vec<u8>> {
    let mut options = Options::default();
    options.fontdb_mut().load_system_fonts();
    if options.fontdb.is_empty() {
        return Err(anyhow!(
            "a PNG needs a font for its numbers, and the system has none: install one, or write SVG"
        ));
    }
    let tree = Tree::from_str(svg, &options).context("the drawing cannot be read")?;
    let size = tree.size();
    let scale = width as f32 / size.width();
    let height = (size.height() * scale).ceil() as u32;
    let mut dots = Pixmap::new(width, height).context("the drawing is too large")?;
    resvg::render(&tree, Transform::from_scale(scale, scale), &mut dots.as_mut());
    dots.encode_png().context("the drawing cannot be written as PNG")
}
