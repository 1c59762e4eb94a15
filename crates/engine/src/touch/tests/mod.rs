mod common;
mod compared;
mod extremes;
mod forms;
