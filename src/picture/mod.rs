//! Pictures of solids, drawn from the exact distance: shaded views, sections, contact sheets.
//!
//! ```text
//!   scene ──> field ──> trace ──> shade ──> render ──┐
//!               └─────────────────────────> section ─┼──> canvas ──> Picture ──> PNG
//!   grid ───> sample ─────────────────────> contact ─┘       text, ticks, colour
//! ```
//!
//! Over a shaded picture come the parameter lines of volumes, where they are in sight (`lines`).
//!
//! Light is linear until the end, where it becomes sRGB. Every pixel is a function of the scene
//! and the options alone, so any number of threads gives the same bytes.

mod annotate;
mod camera;
mod canvas;
pub mod colour;
mod contact;
mod error;
mod field;
mod lines;
mod plot;
mod render;
mod section;
mod shade;
mod text;
mod ticks;
mod trace;

pub use camera::View;
pub use canvas::Picture;
pub use contact::contact_sheet;
pub use error::PictureError;
pub use field::Cut;
pub use plot::{Panel, Series, log_plot};
pub(crate) use render::seen;
pub use render::{MAX_LINES, MAX_PIXELS, MAX_SIDE, RenderOptions, render};
pub use section::{Plane, PlaneAxis, SectionOptions, section};
pub use ticks::round_step;

pub(crate) use colour::material_bytes;
