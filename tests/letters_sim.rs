#[path = "it/letters_simulated.rs"]
mod letters_simulated;
