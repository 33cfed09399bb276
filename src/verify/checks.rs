//! What a job is held against, by name: docs/verify.md has how each is found.

/// Every check and what is wrong with a job that fails it.
pub const CHECKS: [(&str, &str); 13] = [
    ("contour", "The executed steps lie further from the programmed path than the tolerance."),
    ("corners under G64 P", "A corner is cut by more than the P of its G64."),
    ("feed", "The tool moves faster along the path than the programmed feed."),
    ("off the path", "A rotary or secondary axis is not where the path has it."),
    ("end point", "An axis ends at another step than the path."),
    ("speed", "An axis makes more steps in a tick than it, or its node, can."),
    ("acceleration", "An axis is accelerated harder than the machine's profile allows."),
    (
        "rest",
        "An axis does not come to rest, or leaves it too fast, at an end, an event or a seam.",
    ),
    ("jerk", "The acceleration of an axis changes faster than the machine's profile allows."),
    ("beyond travel", "An axis leaves its travel."),
    ("axis that the machine lacks", "An axis moves that the machine does not have."),
    ("ticks of a buffer", "There are more ticks between two seams than a node holds."),
    (
        "events",
        "M, S and T functions and dwells are not those of the program, or not where it has them.",
    ),
];
