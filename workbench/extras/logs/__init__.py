"""ROS bags, motion capture, C3D, logs of controllers, and layouts of public data sets."""
