//! Feed, tool and material → chip, force and power of a milling cut (seed 004, section 5.5).
//!
//! ```text
//! v_f = n·z·f_z                          (5.3)    k_c = (1 - 0.01·γ) / h_m^m_c · k_c1.1     (5.5)
//! P   = a_p·a_e·v_f·k_c / (6·10⁷·η)      (5.4)    h_m = 360·f_z·a_e·sin κ / (π·D·ω)         (5.6)
//! ```
//!
//! a_p is the depth along the tool's axis, a_e the width across the feed; ω the angle over which a tooth is in
//! the work, which follows from the width: cos ω = 1 - 2·a_e/D. (The seed's list of symbols has a_e and a_p
//! the other way round, and so has its table 5.4: 1 and 6 mm with ω = 180° are a slot of the mill's own
//! 6 mm. The product of both is the same; h_m of eq. 5.6 takes the width.)
//!
//! The force is that on one tooth at the mean chip, k_c·a_p·h_m / sin κ; the force of all teeth in the
//! work times the speed of cutting is P·η. The spindle is taken to have its power at every speed, and
//! every feed move to cut the same depth and width: what a program meets on its way is not known here.

pub mod table;

pub use table::{Material, TableError, Tool};

use std::f64::consts::PI;

/// Feed speed v_f in mm/min of a feed a tooth f_z (eq. 5.3).
pub fn feed_mm_min(rpm: f64, teeth: u32, feed_tooth_mm: f64) -> f64 {
    rpm * f64::from(teeth) * feed_tooth_mm
}

/// Mean chip thickness h_m (eq. 5.6).
pub fn chip_mm(tool: &Tool, feed_tooth_mm: f64, width_mm: f64, engaged_deg: f64) -> f64 {
    let sine = libm::sin(tool.edge_angle_deg.to_radians());
    360.0 * feed_tooth_mm * width_mm * sine / (PI * tool.diameter_mm * engaged_deg)
}

/// Specific cutting force k_c in N/mm² (eq. 5.5).
pub fn specific_force_n_mm2(tool: &Tool, material: &Material, chip_mm: f64) -> f64 {
    (1.0 - 0.01 * tool.rake_deg) / libm::pow(chip_mm, material.mc) * material.kc11_n_mm2
}

/// Power in kW at the spindle's motor (eq. 5.4), of a product of depth and width.
pub fn power_kw(section_mm2: f64, feed_mm_min: f64, force_n_mm2: f64, efficiency: f64) -> f64 {
    section_mm2 * feed_mm_min * force_n_mm2 / (6e7 * efficiency)
}

/// The angle over which a tooth is in the work, by the width of the cut.
pub fn engaged_deg(diameter_mm: f64, width_mm: f64) -> f64 {
    libm::acos((1.0 - 2.0 * width_mm / diameter_mm).clamp(-1.0, 1.0)).to_degrees()
}

/// A mill in a material, at a depth and a width.
#[derive(Clone, Debug, PartialEq)]
pub struct Cut {
    /// The mill.
    pub tool: Tool,
    /// What it cuts.
    pub material: Material,
    /// Depth a_p along the tool's axis.
    pub depth_mm: f64,
    /// Width a_e across the feed.
    pub width_mm: f64,
    /// The share η of the spindle's power that reaches the tool.
    pub efficiency: f64,
}

/// What a feed comes to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Load {
    /// The feed.
    pub feed_mm_min: f64,
    /// Feed a tooth, f_z.
    pub feed_tooth_mm: f64,
    /// Mean chip thickness, h_m.
    pub chip_mm: f64,
    /// Specific cutting force, k_c.
    pub force_n_mm2: f64,
    /// Force on a tooth at the mean chip.
    pub tooth_n: f64,
    /// Power that the spindle's motor has to give.
    pub power_kw: f64,
}

/// Why a mill cannot cut so.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum CutError {
    /// Deeper than its teeth are long.
    #[error("{depth_mm} mm is deeper than the tool cuts, {cutting_length_mm} mm")]
    Depth {
        /// What was asked for.
        depth_mm: f64,
        /// How deep it can cut.
        cutting_length_mm: f64,
    },
    /// Wider than the mill.
    #[error("{width_mm} mm is wider than the tool, {diameter_mm} mm")]
    Width {
        /// What was asked for.
        width_mm: f64,
        /// The mill's diameter.
        diameter_mm: f64,
    },
}

impl Cut {
    /// A cut; depth and width are the tool's unless given.
    ///
    /// # Errors
    /// When the tool cannot cut so deep or so wide.
    pub fn new(
        tool: Tool,
        material: Material,
        depth_mm: Option<f64>,
        width_mm: Option<f64>,
        efficiency: f64,
    ) -> Result<Cut, CutError> {
        let depth_mm = depth_mm.unwrap_or(tool.depth_mm);
        let width_mm = width_mm.unwrap_or(tool.width_mm);
        let Tool { cutting_length_mm, diameter_mm, .. } = tool;
        if depth_mm > cutting_length_mm {
            return Err(CutError::Depth { depth_mm, cutting_length_mm });
        }
        if width_mm > diameter_mm {
            return Err(CutError::Width { width_mm, diameter_mm });
        }
        Ok(Cut { tool, material, depth_mm, width_mm, efficiency })
    }

    /// The angle over which a tooth is in the work.
    pub fn engaged_deg(&self) -> f64 {
        engaged_deg(self.tool.diameter_mm, self.width_mm)
    }

    /// What a feed comes to at a speed of the spindle above zero.
    pub fn load(&self, feed_mm_min: f64, rpm: f64) -> Load {
        let feed_tooth_mm = feed_mm_min / (rpm * f64::from(self.tool.teeth));
        let chip_mm = chip_mm(&self.tool, feed_tooth_mm, self.width_mm, self.engaged_deg());
        let force_n_mm2 = specific_force_n_mm2(&self.tool, &self.material, chip_mm);
        let sine = libm::sin(self.tool.edge_angle_deg.to_radians());
        let section_mm2 = self.depth_mm * self.width_mm;
        Load {
            feed_mm_min,
            feed_tooth_mm,
            chip_mm,
            force_n_mm2,
            tooth_n: force_n_mm2 * self.depth_mm * chip_mm / sine,
            power_kw: power_kw(section_mm2, feed_mm_min, force_n_mm2, self.efficiency),
        }
    }

    /// The feed that takes a power: by 5.4 to 5.6 the power goes as the feed to 1 - m_c.
    pub fn feed_for_mm_min(&self, power_kw: f64, rpm: f64) -> f64 {
        let at_one = self.load(1.0, rpm).power_kw;
        libm::pow(power_kw / at_one, 1.0 / (1.0 - self.material.mc))
    }
}
