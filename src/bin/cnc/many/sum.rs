//! What many programs come to together.

use std::fmt;

use serde::Serialize;

use super::judged::Judged;
use crate::plural::count;
use crate::report::counts;

/// A sum over programs.
#[derive(Serialize)]
pub struct Sum {
    #[serde(skip)]
    code: u8,
    pub programs: u64,
    /// Without any error.
    pub passed: u64,
    /// With errors, or with steps that are not their path.
    pub failed: u64,
    /// Not judged: they cannot be read.
    pub unread: u64,
    pub errors: u64,
    pub warnings: u64,
    /// The greatest contour error by its tolerance.
    #[serde(skip_serializing_if = "Option::is_none")]
    worst: Option<Worst>,
}

#[derive(Serialize)]
struct Worst {
    file: String,
    line: Option<u32>,
    max_contour_error_mm: f64,
    tolerance_mm: f64,
}

impl Worst {
    fn share(&self) -> f64 {
        self.max_contour_error_mm / self.tolerance_mm
    }
}

impl Sum {
    /// Of none.
    pub fn new() -> Sum {
        let (programs, passed, failed, unread, errors, warnings) = (0, 0, 0, 0, 0, 0);
        let (code, worst) = (0, None);
        Sum { code, programs, passed, failed, unread, errors, warnings, worst }
    }

    /// With one more.
    pub fn add(&mut self, judged: &Judged) {
        let code = judged.code();
        self.code = self.code.max(code);
        self.programs += 1;
        *(match code {
            0 => &mut self.passed,
            1 => &mut self.failed,
            _ => &mut self.unread,
        }) += 1;
        self.errors += judged.errors();
        self.warnings += judged.warnings();
        let Some(report) = &judged.report else { return };
        let worst = Worst {
            file: judged.name.clone(),
            line: report.worst.map(|at| at.line).filter(|line| *line > 0),
            max_contour_error_mm: report.max_contour_error_mm,
            tolerance_mm: report.tolerance_mm,
        };
        if self.worst.as_ref().is_none_or(|before| worst.share() > before.share()) {
            self.worst = Some(worst);
        }
    }

    /// The worst exit code of all.
    pub fn code(&self) -> u8 {
        self.code
    }
}

/// `9 programs: 7 pass, 1 fails, 1 not read; 2 errors; …`
impl fmt::Display for Sum {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (passed, failed, unread) = (self.passed, self.failed, self.unread);
        write!(f, "{}: {passed} passed", count(self.programs, "program"))?;
        for (number, what) in [(failed, "failed"), (unread, "not judged")] {
            if number > 0 {
                write!(f, ", {number} {what}")?;
            }
        }
        if self.errors + self.warnings > 0 {
            write!(f, "; {}", counts(self.errors, self.warnings))?;
        }
        if let Some(worst) = &self.worst {
            let (error_mm, percent) = (worst.max_contour_error_mm, 100.0 * worst.share());
            write!(
                f,
                "; greatest contour error {error_mm:.4} mm, {percent:.0} % of what is allowed: "
            )?;
            write!(f, "{}", worst.file)?;
            worst.line.map_or(Ok(()), |line| write!(f, ", line {line}"))?;
        }
        Ok(())
    }
}
