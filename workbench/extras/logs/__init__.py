"""ROS bags, MATLAB files, motion capture, logs of controllers, and layouts of public data sets."""
