//! The page as text.
//!
//! ```text
//!   head      policy, title, style
//!   body      facts and notices as HTML; the still picture; places for what the scripts draw
//!   model     JSON: grids, channels, colours, the view
//!   data      base64 of the slabs of the surface and of each channel, one after the other
//!   scripts   one file for each subject, in one scope
//! ```

use super::channels::Stored;
use super::facts::Group;
use super::lattice::Lattice;
use super::sheet::{escaped, nonce, policy, style};
use super::surface::{Made, Surface};
use crate::io::base64;
use crate::picture::View;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::io::{self, Write};

/// The scripts, in the order in which they are read.
const SCRIPTS: [&str; 10] = [
    include_str!("assets/model.js"),
    include_str!("assets/decode.js"),
    include_str!("assets/colour.js"),
    include_str!("assets/state.js"),
    include_str!("assets/camera.js"),
    include_str!("assets/surface.js"),
    include_str!("assets/slices.js"),
    include_str!("assets/readout.js"),
    include_str!("assets/controls.js"),
    include_str!("assets/main.js"),
];
/// What stands in the body, but for facts and data.
const BODY: &str = include_str!("assets/body.html");

/// A page, ready to be written.
#[derive(Debug, Clone)]
pub struct Page {
    pub(super) name: String,
    pub(super) units: String,
    /// `scene` or `stack`.
    pub(super) source: &'static str,
    pub(super) lattice: Lattice,
    pub(super) surface: Option<Surface>,
    pub(super) channels: Vec<Stored>,
    /// Number, name and colour of each material.
    pub(super) materials: Vec<(u32, Option<String>, [u8; 3])>,
    /// What is in the middle of the default view, and how large what it shows is, in scene units.
    pub(super) middle: [f64; 3],
    pub(super) extent: [f64; 2],
    pub(super) facts: Vec<Group>,
    pub(super) notices: Vec<String>,
    /// A PNG file.
    pub(super) still: Option<Vec<u8>>,
}

impl Page {
    /// What the page says beside the numbers: what is left out, reduced or rounded, and the scene's warnings.
    #[must_use]
    pub fn notices(&self) -> &[String] {
        &self.notices
    }

    /// The names of the channels that it holds.
    pub fn channels(&self) -> impl Iterator<Item = &str> {
        self.channels.iter().map(|c| c.head.name.as_str())
    }

    /// One of how many voxels along each axis it shows.
    #[must_use]
    pub fn stride(&self) -> usize {
        self.lattice.stride
    }

    /// Voxels that it shows along x, y and z.
    #[must_use]
    pub fn dims(&self) -> [usize; 3] {
        self.lattice.dims
    }

    /// Writes the page: HTML in UTF-8.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        let model = self.model().to_string().replace('<', "\\u003c");
        let nonce = nonce(&model);
        let title = escaped(&self.name);
        write!(
            out,
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n{}\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<meta name=\"generator\" content=\"voxlathe {}\">\n\
             <title>{title}</title>\n<style nonce=\"{nonce}\">\n{}</style>\n</head>\n",
            policy(&nonce, true),
            env!("CARGO_PKG_VERSION"),
            style(),
        )?;
        let mut rest = BODY;
        while let Some((before, after)) = rest.split_once("{{") {
            let (name, after) = after.split_once("}}").unwrap_or((after, ""));
            out.write_all(before.as_bytes())?;
            self.fill(name, &title, out)?;
            rest = after;
        }
        out.write_all(rest.as_bytes())?;
        writeln!(
            out,
            "<script type=\"application/json\" id=\"model\">{model}</script>"
        )?;
        let slabs = self.surface.iter().map(|s| &s.slabs);
        let slabs = slabs.chain(self.channels.iter().map(|c| &c.slabs));
        for (n, slabs) in slabs.enumerate() {
            let n = if self.surface.is_some() { n } else { n + 1 };
            write!(out, "<script type=\"text/plain\" id=\"data-{n}\">")?;
            digits(slabs, out)?;
            out.write_all(b"</script>\n")?;
        }
        if let Some(skin) = self
            .surface
            .as_ref()
            .map(|s| &s.skin)
            .filter(|s| !s.is_empty())
        {
            out.write_all(b"<script type=\"text/plain\" id=\"skin\">")?;
            digits(skin, out)?;
            out.write_all(b"</script>\n")?;
        }
        write!(
            out,
            "<script nonce=\"{nonce}\">\n\"use strict\";\n(() => {{\n"
        )?;
        for script in SCRIPTS {
            out.write_all(script.as_bytes())?;
        }
        out.write_all(b"})();\n</script>\n</body>\n</html>\n")
    }

    /// What stands in a place of the body.
    fn fill(&self, name: &str, title: &str, out: &mut dyn Write) -> io::Result<()> {
        match name {
            "title" => out.write_all(title.as_bytes()),
            "line" => {
                let [nx, ny, nz] = self.lattice.grid.dims();
                let from = match self.source {
                    "stack" => "a finished stack",
                    _ => "a scene",
                };
                let units = escaped(&super::facts::power(&self.units, 1));
                write!(
                    out,
                    "{nx} × {ny} × {nz} voxels, lengths in {units}, from {from}"
                )
            }
            "facts" => out.write_all(self.facts_html().as_bytes()),
            "notices" => {
                for notice in &self.notices {
                    writeln!(out, "<li>{}</li>", escaped(notice))?;
                }
                Ok(())
            }
            "still" => match &self.still {
                Some(png) => {
                    let about = format!("{}, a still picture of the solid", self.name);
                    let image = super::sheet::picture(png, &about);
                    out.write_all(image.replacen("<img", "<img id=\"still\"", 1).as_bytes())
                }
                None => Ok(()),
            },
            _ => Ok(()),
        }
    }

    fn facts_html(&self) -> String {
        let mut html = String::new();
        for group in self.facts.iter().filter(|g| !g.rows.is_empty()) {
            let _ = write!(
                html,
                "<section class=\"facts\"><h3>{}</h3><dl>",
                group.title
            );
            for [name, value] in &group.rows {
                let (name, value) = (escaped(name), escaped(value).replace('\n', "<br>"));
                let _ = write!(html, "<div><dt>{name}</dt><dd>{value}</dd></div>");
            }
            html += "</dl></section>\n";
        }
        html
    }

    fn model(&self) -> Value {
        let l = &self.lattice;
        json!({
            "version": env!("CARGO_PKG_VERSION"),
            "name": self.name,
            "units": self.units,
            "source": self.source,
            "grid": {
                "dims": l.grid.dims(),
                "origin": l.grid.origin().to_array(),
                "spacing": l.grid.spacing().to_array(),
            },
            "shown": { "dims": l.dims, "first": l.first, "stride": l.stride },
            "surface": self.surface.as_ref().map(surface),
            "channels": self.channels.iter().enumerate().map(|(n, c)| channel(n, c)).collect::<Vec<_>>(),
            "materials": self.materials.iter().map(|(id, name, colour)| json!({
                "id": id,
                "name": name,
                "colour": colour,
            })).collect::<Vec<_>>(),
            "view": {
                "azimuth": View::default().azimuth(),
                "elevation": View::default().elevation(),
                "middle": self.middle,
                "extent": self.extent,
            },
            "still": self.still.is_some(),
        })
    }
}

fn surface(s: &Surface) -> Value {
    let l = &s.lattice;
    #[allow(clippy::cast_precision_loss, reason = "a small number")]
    let step = l.grid.spacing() * l.stride as f64;
    let [i, j, k] = l.first;
    let corner = l.grid.centre(i, j, k) - 0.5 * step;
    json!({
        "data": "data-0",
        "dims": l.dims,
        "corner": corner.to_array(),
        "spacing": step.to_array(),
        "unit": s.unit,
        "distance": s.made == Made::Distance,
        "layers": s.layers,
        "slabs": s.slabs.iter().map(Vec::len).collect::<Vec<_>>(),
        "skin": s.skin.iter().map(Vec::len).collect::<Vec<_>>(),
    })
}

fn channel(n: usize, c: &Stored) -> Value {
    json!({
        "data": format!("data-{}", n + 1),
        "name": c.head.name,
        "unit": c.head.unit,
        "meaning": c.head.meaning,
        "kind": c.head.kind.name(),
        "range": c.range,
        "exact_within": c.exact_within,
        "layers": c.layers,
        "slabs": c.slabs.iter().map(Vec::len).collect::<Vec<_>>(),
    })
}

/// Writes the base64 digits of all slabs as one run of bytes.
fn digits(slabs: &[Vec<u8>], out: &mut dyn Write) -> io::Result<()> {
    const PIECE: usize = 3 << 16;
    let mut waiting: Vec<u8> = Vec::with_capacity(2 * PIECE);
    for slab in slabs {
        for part in slab.chunks(PIECE) {
            waiting.extend_from_slice(part);
            let whole = waiting.len() / 3 * 3;
            out.write_all(&base64::text(&waiting[..whole]))?;
            waiting.drain(..whole);
        }
    }
    out.write_all(&base64::text(&waiting))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slabs_are_one_run_of_digits() {
        let slabs: Vec<Vec<u8>> = (0..5_u8).map(|n| vec![n; usize::from(n) * 7 + 1]).collect();
        let mut found = Vec::new();
        digits(&slabs, &mut found).expect("memory");
        assert_eq!(found, base64::text(&slabs.concat()));
    }

    #[test]
    fn every_place_of_the_body_is_filled() {
        let places = BODY.split("{{").skip(1);
        let names: Vec<&str> = places
            .filter_map(|p| p.split_once("}}"))
            .map(|p| p.0)
            .collect();
        assert_eq!(names, ["title", "line", "still", "notices", "facts"]);
        // A script's end within the scripts would end them.
        for script in SCRIPTS {
            assert!(!script.contains("</script") && !script.contains("<!--"));
        }
    }
}
