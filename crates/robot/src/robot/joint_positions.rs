//! The joint positions in a message.

use super::messages::JointState;
use crate::error::{Result, failed};

/// The joints of `state` with their positions, rad or m. A state without positions has none.
///
/// # Errors
/// It has not a position for each name.
pub(super) fn joint_positions(state: &JointState) -> Result<impl Iterator<Item = (&String, f64)>> {
    if !state.position.is_empty() && state.position.len() != state.name.len() {
        return Err(failed!(
            "a state has {} names and {} positions; send one for each",
            state.name.len(),
            state.position.len()
        ));
    }
    Ok(state.name.iter().zip(state.position.iter().copied()))
}
