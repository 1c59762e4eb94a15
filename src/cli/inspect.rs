//! `somatic inspect`: what a body holds.
use clap::Args;
use somatic::Result;
/// Say what links, taxels and fields a body has, and what is odd about it.
#[derive(Args)]
pub(super) struct Arguments {
    body: String,
}
pub(super) fn inspect(arguments: &Arguments) -> Result<u8> {
    let _ = super::load_body(&arguments.body)?;
    Ok(super::DONE)
}
