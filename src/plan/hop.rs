//! The time that the path from one stop to the next takes.

use super::extreme::{greater, lesser};
use super::piece::Piece;

/// A way from rest to rest, along pieces that follow each other straight on.
#[derive(Clone, Copy, Debug)]
pub struct Hop {
    length_mm: f64,
    /// The time that it takes at the pieces' greatest speeds.
    cruise_s: f64,
    /// The least of the pieces' greatest accelerations, and of their greatest jerks.
    accel_mm_s2: f64,
    jerk_mm_s3: f64,
}

impl Hop {
    /// Of no length.
    pub const NONE: Hop = Hop {
        length_mm: 0.0,
        cruise_s: 0.0,
        accel_mm_s2: f64::INFINITY,
        jerk_mm_s3: f64::INFINITY,
    };

    /// Goes on along a piece.
    pub fn add(&mut self, piece: &Piece) {
        self.length_mm += piece.length_mm;
        self.cruise_s += piece.length_mm / piece.speed_sq_max().sqrt();
        self.accel_mm_s2 = lesser(self.accel_mm_s2, piece.accel_max_mm_s2());
        self.jerk_mm_s3 = lesser(self.jerk_mm_s3, piece.jerk.along_mm_s3());
    }

    /// How long it takes, about: with the acceleration a up and down, or the jerk j up, down and up again
    /// (l = j·t³/32), whichever is longer. Where both bind that is up to a tenth too little. Where the limit of
    /// speed v is less than the peak of that, it takes l/v + v/a: half of the time without the limit more than the
    /// cruise at most.
    pub fn time_s(&self) -> f64 {
        let accel_s = 2.0 * (self.length_mm / self.accel_mm_s2).sqrt();
        let half_s = 0.5 * greater(accel_s, libm::cbrt(32.0 * self.length_mm / self.jerk_mm_s3));
        half_s + greater(half_s, self.cruise_s)
    }
}
