//! Draws progress on a terminal (indicatif).
