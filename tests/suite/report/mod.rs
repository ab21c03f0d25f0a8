//! Reports, documents and pages of results.

pub mod browser;
pub mod certificate;
pub mod first_screen;
pub mod json_document;
pub mod json_page;
pub mod keys_page;
pub mod pages;
pub mod paper;
