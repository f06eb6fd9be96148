//! The guide: what a user of the command meets, a page for each subject.

#[doc = include_str!("cut_cells.md")]
pub mod cut_cells {}

#[doc = include_str!("formats.md")]
pub mod formats {}

#[doc = include_str!("page.md")]
pub mod page {}

#[doc = include_str!("quantities.md")]
pub mod quantities {}

#[doc = include_str!("recipes.md")]
pub mod recipes {}
