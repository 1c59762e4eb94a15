//! Robots: joints that move a body's links, and the messages that robots exchange.
//!
//! [`Kinematics`] turns joint positions into poses of links, [`JointedSource`] does so for every frame of a source:
//!
//! ```
//! use somatic_robot::robot::Kinematics;
//!
//! let urdf = r#"<robot name="r"><link name="arm"/><link name="hand"/>
//!   <joint name="wrist" type="revolute"><parent link="arm"/><child link="hand"/>
//!     <origin xyz="0.3 0 0"/><axis xyz="0 0 1"/></joint></robot>"#;
//! let robot = Kinematics::from_urdf("r", urdf)?;
//! let poses = robot.link_poses(&[std::f64::consts::FRAC_PI_2]);
//! let (hand, arm_from_hand) = poses.iter().find(|(link, _)| *link == "hand").unwrap();
//! assert_eq!((*hand, arm_from_hand.translation.x), ("hand", 0.3));
//! # Ok::<(), somatic_skin::error::Error>(())
//! ```

#[cfg(feature = "mcap")]
mod bag_poses;
#[cfg(feature = "mcap")]
mod bag_source;
#[cfg(feature = "mcap")]
mod bag_states;
#[cfg(feature = "mcap")]
mod cloud_merge;
#[cfg(feature = "mcap")]
mod defined;
#[cfg(feature = "meshes")]
mod drawn;
#[cfg(any(feature = "mcap", feature = "ros2"))]
mod joint_positions;
#[cfg(feature = "meshes")]
mod joint_remarks;
#[cfg(feature = "meshes")]
mod jointed_source;
#[cfg(feature = "mcap")]
mod joints_delay;
#[cfg(feature = "meshes")]
mod kinematics;
#[cfg(feature = "ros2")]
mod live_joints;
#[cfg(feature = "mcap")]
mod mapped_bag;
#[cfg(feature = "ros2")]
mod mapped_topic;
#[cfg(feature = "meshes")]
mod matching;
pub mod messages;
#[cfg(any(feature = "mcap", feature = "ros2"))]
mod places;
#[cfg(feature = "mcap")]
mod posed_source;
#[cfg(feature = "ros2")]
mod ros2_source;
#[cfg(feature = "ros2")]
mod stamped_states;

#[cfg(feature = "mcap")]
pub use bag_poses::{BagPoses, poses_of_bag};
#[cfg(feature = "mcap")]
pub use bag_source::BagSource;
#[cfg(feature = "mcap")]
pub use bag_states::joint_states_of_bag;
#[cfg(feature = "meshes")]
pub use drawn::drawn_poses;
#[cfg(feature = "meshes")]
pub use jointed_source::{JointOptions, JointedSource};
#[cfg(feature = "mcap")]
pub use joints_delay::{DelayEstimate, Transport};
#[cfg(feature = "meshes")]
pub use kinematics::Kinematics;
#[cfg(feature = "ros2")]
pub use live_joints::{LiveJoints, StatesTime};
#[cfg(feature = "mcap")]
pub use mapped_bag::mapped_bag;
#[cfg(feature = "ros2")]
pub use mapped_topic::mapped_topic;
#[cfg(feature = "meshes")]
pub use matching::{LinkMatches, MAX_REST_ANGLE_RAD, MAX_REST_DISTANCE_M};
#[cfg(feature = "mcap")]
pub use posed_source::PosedSource;
#[cfg(feature = "ros2")]
pub use ros2_source::Ros2Source;
