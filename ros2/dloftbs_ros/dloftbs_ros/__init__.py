"""A ROS 2 node that publishes the cables in a camera's images as curves; see `dloftbs_ros.node`."""
