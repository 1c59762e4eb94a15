//! Which times messages of ROS have.

words! {"time of ROS messages",
    /// Which times messages of ROS have.
    #[derive(Default)]
    RosTime {
        /// Those of the frames.
        #[default]
        Recording = "recording",
        /// The first is this computer's, and those of the frames say how it goes on.
        Wall = "wall",
    }
}
