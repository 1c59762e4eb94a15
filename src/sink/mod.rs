//! Sinks: where percepts go.
