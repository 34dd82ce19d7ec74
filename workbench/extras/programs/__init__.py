"""Joint targets in programs of ABB, KUKA, Yaskawa and Universal Robots."""
