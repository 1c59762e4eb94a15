//! Percepts as messages of ROS 2: taxels, touches, wrenches, links, joints and boards, in a bag or live.

mod bag;
mod clock;
#[cfg(feature = "ros2")]
mod live;
mod messages;
mod moment;
mod places;
mod readings;
mod touches;
mod wrenches;

pub use bag::Ros2BagSink;
#[cfg(feature = "ros2")]
pub use live::Ros2Sink;
