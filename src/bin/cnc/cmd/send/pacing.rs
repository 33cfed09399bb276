//! How well a job's ticks kept their period, for a person.

use cnc::wire::{PacingFigures, SLIDE_US};
use cnc::wire_io::Priority;

/// Says it on standard error; all lateness in steps of a doubling, if the user wants more.
pub fn say(pacing: &PacingFigures, verbose: bool) {
    let (Some(least_us), Some(p999_us), Some(greatest_us)) =
        (pacing.least_us, pacing.p999_us, pacing.greatest_us)
    else {
        return;
    };
    say!(
        "pacing    {} intervals of {} ms: least {}, 99.9 % up to {}, greatest {}",
        pacing.intervals,
        ms(pacing.period_us),
        ms(least_us),
        ms(p999_us),
        ms(greatest_us)
    );
    let mut said = match pacing.slides {
        0 => format!("no tick {} ms late", ms(SLIDE_US)),
        slides => format!(
            "{slides} ticks {} ms or more late, {} of them since the answer before was",
            ms(SLIDE_US),
            pacing.slides_by_answer
        ),
    };
    if let Some(percent) = pacing.fill_busy_percent {
        said += &format!("; the line was busy for {percent} % of the fills");
    }
    say!("          {said}");
    if verbose {
        histogram(&pacing.late_histogram);
    }
}

/// Says that other programs may have held the ticks up, where that matters.
pub fn say_priority(pacing: &PacingFigures, priority: Priority, verbose: bool) {
    match priority {
        Priority::Refused if verbose || pacing.slides > 0 => say!(
            "the system gave no real-time priority, so other programs may hold ticks up; it does with \
             `@dialout - rtprio 10` in /etc/security/limits.conf, after the next login"
        ),
        Priority::RealTime if verbose => say!("ticks are sent with real-time priority"),
        _ => {}
    }
}

fn histogram(late: &[(u64, u64)]) {
    let doubling = |us: u64| u64::BITS - us.leading_zeros();
    let most = late.last().map_or(0, |(from_us, _)| doubling(*from_us));
    for step in 0..=most {
        let of_step = late.iter().filter(|(from_us, _)| doubling(*from_us) == step);
        let count: u64 = of_step.map(|(_, count)| count).sum();
        if count > 0 {
            say!("          late by less than {:>8} ms: {count}", ms(1 << step));
        }
    }
}

/// Microseconds as milliseconds, to the microsecond.
fn ms(us: u64) -> String {
    let text = format!("{}.{:03}", us / 1000, us % 1000);
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}
