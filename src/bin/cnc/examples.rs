//! What `--help` begins with: a few lines to copy, for each command. `tests/manners.rs` runs them.

/// Examples of `cnc` itself: one a command.
const OF_ALL: &str = "  cnc interpret part.nc                      what a program means, and all that is wrong with it
  cnc interpolate part.nc                    time, ticks, extents, seams
  cnc interpolate part.nc --csv -o part.csv  the steps of every tick
  cnc verify part.nc part.csv                are those steps the programmed path?
  cnc cut part.nc --tool end-mill-6 --material brass-cuzn39pb3  does the spindle carry its feeds?
  cnc diff old.csv new.csv                   what a change of program or profile changes
  cnc plot part.nc -o part.svg               what it looks like, and how fast
  cnc report part.nc -o part.html            all about it on one page
  cnc send sim: part.nc                      run it on simulated nodes
  cnc send /dev/ttyUSB0 part.nc              run it on the machine
  cnc replay job.jsonl part.nc               how far each axis got when the link was lost
  cnc jog /dev/ttyUSB0 X --by -5             move one axis by 5 mm
  cnc home /dev/ttyUSB0                      send the axes to their switches
  cnc ports                                  which serial ports there are
  cnc machine show router                    what a machine can do
  cnc bus part.nc                            which interfaces keep up with a program
  cnc explain no-feed                        what a rule or a code means";

/// What the end of `cnc --help` says.
pub const CODES: &str = "\
Exit codes:
  0    done, nothing wrong
  1    the program, dump or job is bad
  2    usage, machine profile or file trouble
  3    the port, the bus or a node failed; the job did not finish
  130  interrupted

FILE may be - (standard input).
Results go to standard output, messages to standard error.
Defaults of options may stand in the environment (CNC_MACHINE, …) and in
cnc.toml (docs/configuration.md).";

/// The examples of a command, by its name; a subcommand of one is named with it.
pub fn of(command: &str) -> Option<&'static str> {
    Some(match command {
        "cnc" => OF_ALL,
        "interpret" => INTERPRET,
        "interpolate" => INTERPOLATE,
        "verify" => VERIFY,
        "cut" => CUT,
        "diff" => DIFF,
        "plot" => PLOT,
        "report" => REPORT,
        "send" => SEND,
        "replay" => REPLAY,
        "jog" => JOG,
        "home" => HOME,
        "node" => NODE,
        "ports" => PORTS,
        "machine" => MACHINE,
        "list" => "  cnc machine list                           built-in profiles",
        "show" => MACHINE_SHOW,
        "check" => "  cnc machine check mill.toml                every key and value",
        "bus" => BUS,
        "explain" => EXPLAIN,
        "completions" => COMPLETIONS,
        "man" => MAN,
        _ => return None,
    })
}

const INTERPRET: &str =
    "  cnc interpret part.nc                      all that is wrong with it, or what it means
  cnc interpret part.nc -q                   check it only
  cnc interpret part.nc --json               canonical motion, one object a line
  cnc interpret .                            all programs of a folder and below it
  cnc interpret part.nc --format github      errors as annotations of a pull request
  cnc interpret part.nc --dialect fanuc      as a FANUC-style control reads it
  cnc interpret - < part.nc                  from standard input";

const INTERPOLATE: &str = "  cnc interpolate part.nc                    time, ticks, extents, seams
  cnc interpolate part.nc --csv -o part.csv  the steps of every tick, as a sealed dump
  cnc interpolate part.nc --explain-feed     what sets the speed of each block
  cnc interpolate part.nc --times            what each block and each tool takes
  cnc interpolate part.nc --override 50%     with the feeds of cuts halved
  cnc interpolate part.nc --method b --svg drift.svg  if the nodes interpolated by equations";

const VERIFY: &str =
    "  cnc verify part.nc part.csv                are those steps the programmed path?
  cnc verify part.nc part.csv -q             say nothing unless they are not
  cnc verify part.nc part.csv --json         every check with its value and limit
  cnc verify part.nc part.csv --blocks       how far each block is off, too
  cnc verify . --format junit -o junit.xml   all programs of a folder, for a CI system
  cnc verify part.nc other.csv --unsealed    steps that another tool has written";

const CUT: &str =
    "  cnc cut part.nc --tool end-mill-6 --material brass-cuzn39pb3  power of each cut
  cnc cut part.nc --tool end-mill-3 --material brass-cuzn39pb3 --depth 1 --rpm 2000  cut less deep";

const DIFF: &str =
    "  cnc diff old.csv new.csv                   the first tick that differs, distance, times
  cnc diff part.nc part.csv                  is the dump what the program still makes?
  cnc diff old.csv new.csv --tolerance 0.01  be content with 0.01 mm";

const PLOT: &str = "  cnc plot part.nc -o part.svg               the path from four sides
  cnc plot part.nc --view xy -o part.png     from above, in dots
  cnc plot part.nc --curve speed -o speed.svg  what the axes do over time
  cnc plot part.csv -o part.svg              the path of a dump";

const REPORT: &str = "  cnc report part.nc -o part.html            all about it on one page
  cnc report part.nc --json > part.json      the same for scripts, and for --merge
  cnc report --merge part.json -o all.html   results of many programs on one page";

const SEND: &str =
    "  cnc send sim: part.nc                      run it on simulated nodes, in no time
  cnc send sim: part.nc --dry-run            check and show the job, send nothing
  cnc send /dev/ttyUSB0 part.nc              run it on the machine; asks before it starts
  cnc send /dev/ttyUSB0 part.csv --yes --trace job.jsonl  a dump, without asking, every byte kept
  cnc send sim: -e 'G0 X10' -e 'G0 X0'       blocks as typed";

const REPLAY: &str =
    "  cnc replay job.jsonl                       did the nodes answer as they should?
  cnc replay job.jsonl part.nc               how far each axis got, on which line";

const JOG: &str =
    "  cnc jog sim: X --by -5                     5 mm towards minus, on simulated nodes
  cnc jog /dev/ttyUSB0 Z --by 2 --feed 120   2 mm up at 120 mm/min
  cnc jog /dev/ttyUSB0 X --by 10 --dry-run   show what would be done";

const HOME: &str = "  cnc home sim: Z --measured-tick 40000      one axis to its switch, simulated
  cnc home /dev/ttyUSB0                      all, in the profile's order
  cnc home /dev/ttyUSB0 Z X                  some, in this order";

const NODE: &str = "  cnc node --link /tmp/bus                   then: cnc send /tmp/bus part.nc
  cnc node --link /tmp/bus --once --speed max  in no time, for one job
  cnc node --link /tmp/bus --fault drop:Y@data.17  with a byte that is lost";

const PORTS: &str = "  cnc ports                                  the likeliest first
  cnc ports --json                           for scripts";

const MACHINE: &str = "  cnc machine list                           built-in profiles
  cnc machine show router                    what a machine can do, and where each value is from
  cnc machine show router --toml > mill.toml  start an own profile
  cnc machine check mill.toml                every key and value";

const MACHINE_SHOW: &str =
    "  cnc machine show                           what would be used, and who has chosen it
  cnc machine show mill.toml                 each value with its line, or that it is a default
  cnc machine show router --toml > mill.toml  start an own profile";

const BUS: &str = "  cnc bus                                    what each interface carries
  cnc bus --nodes 1-8 --protocol frame       for several numbers of axes
  cnc bus part.nc                            which interfaces keep up with a program
  cnc bus part.nc --ring                     a virtual ring of drives executes it";

const EXPLAIN: &str =
    "  cnc explain no-feed                        a rule, with the mistake and the mended program
  cnc explain G43                            a code, here and on other controls
  cnc explain                                all of them";

const COMPLETIONS: &str = "  cnc completions bash > ~/.local/share/bash-completion/completions/cnc
  cnc completions zsh > ~/.zfunc/_cnc
  cnc completions fish > ~/.config/fish/completions/cnc.fish";

const MAN: &str = "  cnc man | man -l -                         read it
  cnc man -o ~/.local/share/man/man1         install it: cnc.1, cnc-send.1, …";
