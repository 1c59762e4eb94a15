//! Names of topics and types in DDS and in ROS, and what the environment says about the network.

use crate::error::{Error, Result};

/// The domain's variable, and the highest number that it may have.
const DOMAIN: &str = "ROS_DOMAIN_ID";
const MAX_DOMAIN: u16 = 232;

/// The topic that DDS calls `name`; `None` where it is none of ROS's.
pub(super) fn ros_topic(name: &str) -> Option<String> {
    name.strip_prefix("rt/").map(|name| format!("/{name}"))
}

/// The type that DDS calls `name`.
pub(super) fn ros_type(name: &str) -> Option<String> {
    let (package, kind) = name.split_once("::msg::dds_::")?;
    Some(format!("{package}/msg/{}", kind.strip_suffix('_')?))
}

/// The domain that `ROS_DOMAIN_ID` says, 0 where it is not set.
///
/// # Errors
/// It is not a number of a domain.
pub(super) fn domain() -> Result<u16> {
    domain_of(std::env::var(DOMAIN).ok().as_deref())
}

fn domain_of(text: Option<&str>) -> Result<u16> {
    let Some(text) = text.map(str::trim).filter(|text| !text.is_empty()) else { return Ok(0) };
    text.parse().ok().filter(|domain| *domain <= MAX_DOMAIN).ok_or_else(|| {
        Error::usage(format!("{DOMAIN} is `{text}`; set it to a whole number from 0 to {MAX_DOMAIN}, or leave it out"))
    })
}

/// Whether the environment keeps ROS 2 on this computer.
pub(super) fn is_local() -> bool {
    is_local_by(|name| std::env::var(name).ok())
}

fn is_local_by(variable: impl Fn(&str) -> Option<String>) -> bool {
    variable("ROS_AUTOMATIC_DISCOVERY_RANGE").is_some_and(|range| range == "LOCALHOST")
        || variable("ROS_LOCALHOST_ONLY").is_some_and(|only| only == "1")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_dds_are_those_of_ros() {
        assert_eq!(ros_topic("rt/arm/skin").as_deref(), Some("/arm/skin"));
        assert_eq!(ros_topic("rq/arm/getRequest"), None);
        assert_eq!(ros_type("sensor_msgs::msg::dds_::PointCloud2_").as_deref(), Some("sensor_msgs/msg/PointCloud2"));
        assert_eq!(ros_type("rcl_interfaces::srv::dds_::Get_"), None);
    }

    #[test]
    fn the_environment_says_domain_and_range() {
        assert_eq!([None, Some(""), Some(" 42 "), Some("232")].map(|text| domain_of(text).unwrap()), [0, 0, 42, 232]);
        for text in ["233", "-1", "a", "1.5"] {
            let error = domain_of(Some(text)).unwrap_err();
            assert!(error.is_usage() && error.to_string().contains("ROS_DOMAIN_ID"), "{error}");
        }
        let with =
            |set: &'static str, value: &'static str| is_local_by(move |name| (name == set).then(|| value.to_owned()));
        assert!(with("ROS_LOCALHOST_ONLY", "1") && with("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"));
        assert!(!with("ROS_LOCALHOST_ONLY", "0") && !with("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET"));
    }
}
