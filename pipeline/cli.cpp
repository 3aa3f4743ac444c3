#include "pipeline/cli.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <new>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "geometry/error.h"
#include "io/file.h"
#include "io/iges.h"
#include "io/panel_file.h"
#include "pipeline/allocation_count.h"
#include "pipeline/console.h"
#include "pipeline/convert.h"
#include "pipeline/drape.h"
#include "pipeline/inspect.h"
#include "pipeline/json_text.h"
#include "pipeline/pattern_scene.h"
#include "pipeline/scene.h"
#include "pipeline/study.h"
#include "pipeline/templates.h"
#include "pipeline/units.h"
#include "pipeline/version.h"

namespace toile {
namespace {

// A command line that parses but makes no sense.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct Common {
  bool quiet = false, verbose = false, json = false, no_progress = false, overwrite = false;
  std::string colour = "auto";
  int threads = 0;  // unset: one for a drape, each core for inspect
};

void add_common(CLI::App& app, Common& common) {
  app.add_flag("-q,--quiet", common.quiet, "Errors only");
  app.add_flag("-v,--verbose", common.verbose, "Say more");
  app.add_flag("--json", common.json, "Results as JSON on stdout");
  app.add_flag("--no-progress", common.no_progress, "No progress line");
  app.add_flag("--overwrite", common.overwrite, "Replace files of a former run");
  app.add_option("--color", common.colour, "auto or never")->check(CLI::IsMember({"auto", "never"}));
  app.add_option("--threads", common.threads,
                 "Threads of a drape (1) or of inspect (one for each core); any number gives the same bytes")
      ->check(CLI::Range(1, 64));
}

struct DrapeArguments {
  std::string input, directory;
  std::vector<std::string> settings, pins;
  std::string until, fabric, span, time_limit;
  std::optional<std::string> resume;
  int degree = 0;
  bool dry = false;
};

struct InspectArguments {
  std::string input, svg, png, html, span;
  int degree = 0, spans = 0;
};

void add_refinement(CLI::App& command, InspectArguments& a) {
  command.add_option("--degree", a.degree, "Degree")->check(CLI::Range(1, 5));
  auto* span = command.add_option("--span", a.span, "Longest knot span (\"20 mm\")");
  command.add_option("--spans", a.spans, "Spans per direction")->check(CLI::Range(1, 10000))->excludes(span);
}

double length_option(const std::string& text, const char* option) {
  try {
    const double length = parse_quantity(text, dimension::length);
    if (length > 0) return length;
  } catch (const InputError& error) {
    throw UsageError(fmt::format("{}: {}", option, error.what()));
  }
  throw UsageError(fmt::format("{} must be positive", option));
}

Scene scene_of(const DrapeArguments& a) {
  std::vector<std::string> settings = a.settings;
  for (const std::string& s : settings) {
    const std::size_t equals = s.find('=');
    if (equals == std::string::npos || s.find_first_not_of(" .[]") == equals)
      throw UsageError(fmt::format("--set {}: expected key=value", s));
  }
  if (!a.until.empty()) settings.push_back("solver.until=" + a.until);
  if (!a.time_limit.empty()) settings.push_back("solver.time_limit=" + a.time_limit);
  const bool scene_file = std::filesystem::path(a.input).extension() == ".toml";
  if (scene_file) {
    if (!a.pins.empty() || !a.fabric.empty() || !a.span.empty() || a.degree > 0) {
      throw UsageError("--pin, --fabric, --span and --degree are for panel files; in a scene use its keys or --set");
    }
    return read_scene(a.input, settings);
  }
  QuickScene quick;
  quick.file = a.input;
  quick.pins = a.pins;
  if (a.pins.empty()) throw UsageError("a panel file needs at least one --pin, such as --pin curve:0,2");
  for (const std::string& pin : a.pins) {
    try {
      parse_address(pin);
    } catch (const InputError& error) {
      throw UsageError(fmt::format("--pin: {}", error.what()));
    }
  }
  if (!a.fabric.empty()) {
    const auto presets = fabric_presets();
    if (std::ranges::find(presets, a.fabric, &FabricPreset::name) == presets.end()) {
      throw UsageError(fmt::format("--fabric: no preset is called '{}'; see toile presets", a.fabric));
    }
    quick.fabric = a.fabric;
  }
  if (a.degree > 0) quick.degree = a.degree;
  if (!a.span.empty()) quick.span = length_option(a.span, "--span");
  return quick_scene(quick, settings);
}

int run_drape(const DrapeArguments& a, const Common& common, Console& console) {
  Scene scene = scene_of(a);
  if (a.dry) return dry_run(std::move(scene), common.json, console);
  DrapeOptions options;
  if (!a.directory.empty()) options.directory = a.directory;
  options.overwrite = common.overwrite;
  options.json = common.json;
  std::signal(SIGPIPE, SIG_IGN);  // a reader of the messages that goes away doesn't end the run
  options.threads = std::max(1, common.threads);
  if (allocation_count()) options.allocations = [] { return *allocation_count(); };
  if (a.resume) options.resume = *a.resume;
  return drape(std::move(scene), options, console);
}

InspectOptions options_of(const InspectArguments& a) {
  InspectOptions options;
  if (a.degree > 0) options.degree = a.degree;
  if (a.spans > 0) options.spans = a.spans;
  if (!a.span.empty()) options.span = length_option(a.span, "--span");
  return options;
}

int run_convert(const InspectArguments& a, const std::string& target, const Common& common, Console& console) {
  std::error_code error;
  if (!common.overwrite && std::filesystem::equivalent(a.input, target, error))
    throw OutputError(fmt::format("{} is the input; give --overwrite to replace it", target));
  const PanelFile file = read_panels(a.input);
  const Conversion conversion = convert(file, target, options_of(a));
  for (const std::string& warning : conversion.warnings) console.warning(warning);
  write_file(target, conversion.bytes);
  std::string notes;
  for (const std::string& note : conversion.notes) notes += (notes.empty() ? "" : "; ") + note;
  console.note(fmt::format("wrote {}: {}", target, notes));
  if (common.json) {
    const nlohmann::ordered_json out = {{"file", utf8(a.input)},
                                        {"output", utf8(target)},
                                        {"panels", file.panels.size()},
                                        {"bytes", conversion.bytes.size()},
                                        {"notes", conversion.notes}};
    fmt::print("{}\n", json_text(out));
  }
  return exit_ok;
}

int run_inspect(const InspectArguments& a, const Common& common, Console& console) {
  InspectOptions options = options_of(a);
  options.threads = common.threads;
  const Inspection inspection = inspect(read_panels(a.input), options);
  const auto draw = [&](const std::string& target, auto format) {
    if (target.empty()) return;
    write_file(target, format(inspection));
    console.note("wrote " + target);
  };
  draw(a.svg, inspect_svg);
  draw(a.png, inspect_png);
  draw(a.html, inspect_html);
  if (common.json) {
    fmt::print("{}\n", json_text(inspect_json(inspection, common.threads), 1));
  } else {
    fmt::print("{}", inspect_text(inspection, common.verbose));
  }
  for (const std::string& panel : inspection.refused) console.error(panel);
  return inspection.refused.empty() ? exit_ok : exit_geometry;
}

int run_roundtrip(const std::string& input, bool rewrite, const Common& common) {
  const PanelFile file = read_panels(input);
  const RoundtripReport r = roundtrip(file, rewrite ? IgesMode::rewrite : IgesMode::replay);
  if (common.json) {
    nlohmann::ordered_json warnings = nlohmann::ordered_json::array();
    for (const std::string& warning : file.warnings) warnings.push_back(utf8(warning));
    const nlohmann::ordered_json out = {{"file", input},
                                        {"mode", rewrite ? "rewrite" : "replay"},
                                        {"exact", r.exact()},
                                        {"faces", r.faces},
                                        {"faces_lost", r.faces_lost},
                                        {"entities", r.entities},
                                        {"entities_lost", r.entities_lost},
                                        {"knots_equal", r.knots_equal},
                                        {"weights_equal", r.weights_equal},
                                        {"points_equal", r.points_equal},
                                        {"parameter_curves_equal", r.parameter_curves_equal},
                                        {"differences", r.differences},
                                        {"warnings", warnings},
                                        {"ledger", ledger_json(file.ledger)}};
    fmt::print("{}\n", json_text(out));
  } else {
    fmt::print(
        "{}: {} of {} faces, {} of {} entities kept; knots {}, weights {}, control points {}, parameter curves {}\n",
        input, r.faces - r.faces_lost, r.faces, r.entities - r.entities_lost, r.entities,
        r.knots_equal ? "equal" : "DIFFER", r.weights_equal ? "equal" : "DIFFER", r.points_equal ? "equal" : "DIFFER",
        r.parameter_curves_equal ? "equal" : "DIFFER");
    for (const std::string& difference : r.differences) fmt::print("  {}\n", difference);
    fmt::print("{}", ledger_text(file.ledger));
    for (const std::string& warning : file.warnings) fmt::print("  warning     {}\n", warning);
  }
  return r.exact() ? exit_ok : exit_check;
}

struct InitArguments {
  std::string name, output, pattern, body;
};

int run_init_pattern(const InitArguments& a, const Common& common, Console& console) {
  if (!a.name.empty()) throw UsageError("give a template or --pattern, not both");
  std::filesystem::path target = a.output.empty() ? "scene.toml" : a.output;
  if (target.extension() != ".toml") target /= "scene.toml";
  if (!common.overwrite && std::filesystem::exists(target)) {
    throw OutputError(fmt::format("{} exists; give --overwrite to replace it", target.string()));
  }
  const auto body = a.body.empty() ? std::nullopt : std::optional<std::filesystem::path>(a.body);
  const PatternScene scene = pattern_scene(a.pattern, body, target);
  for (const std::string& warning : scene.warnings) console.warning(warning);
  write_file(target, scene.text);
  for (const std::string& note : scene.notes) console.note(note);
  console.note(fmt::format("wrote {0}; now: toile check {0}", target.string()));
  return exit_ok;
}

int run_study_file(const std::string& input, const std::string& directory, const Common& common, Console& console) {
  StudyOptions options;
  // Each run is this very program.
  options.program = std::filesystem::read_symlink("/proc/self/exe");
  if (!directory.empty()) options.directory = directory;
  options.overwrite = common.overwrite;
  options.json = common.json;
  options.threads = std::max(1, common.threads);
  return run_study(read_study(input), options, console);
}

int run_init(const std::string& name, const std::string& directory, const Common& common, Console& console) {
  if (name.empty()) {
    for (const SceneTemplate& t : scene_templates()) fmt::print("{:8} {}\n", t.name, t.about);
    return exit_ok;
  }
  const auto templates = scene_templates();
  if (std::ranges::find(templates, name, &SceneTemplate::name) == templates.end()) {
    throw UsageError(fmt::format("no template is called '{}'; `toile init` lists them", name));
  }
  const std::filesystem::path folder =
      directory.empty() ? std::filesystem::path(name) : std::filesystem::path(directory);
  const std::vector<TemplateFile> files = scene_template(name);
  for (const TemplateFile& file : files) {
    if (!common.overwrite && std::filesystem::exists(folder / file.name)) {
      throw OutputError(fmt::format("{} exists; give --overwrite to replace it", (folder / file.name).string()));
    }
  }
  for (const TemplateFile& file : files) write_file(folder / file.name, file.bytes);
  console.note(fmt::format("wrote {0}; now: toile drape {0}", (folder / "scene.toml").string()));
  return exit_ok;
}

int run_presets(const Common& common) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  for (const FabricPreset& p : fabric_presets()) {
    const Fabric& f = p.fabric;
    if (common.json) {
      out.push_back(
          {{"name", p.name},
           {"about", p.about},
           {"density", f.density},
           {"thickness", f.thickness},
           {"membrane", {{"weft", f.membrane.weft}, {"warp", f.membrane.warp}, {"shear", f.membrane.shear}}},
           {"bending", {{"b0", f.bending.b0}, {"kappa0", f.bending.kappa0}, {"kappa_reg", f.bending.kappa_reg}}},
           {"drag", f.drag},
           {"friction", f.friction}});
    } else {
      fmt::print("{:10} {}: {:.4g} kg/m2, {:.4g} N/m, B0 {:.2g} N m\n", p.name, p.about, f.density, f.membrane.weft,
                 f.bending.b0);
    }
  }
  if (common.json) fmt::print("{}\n", json_text(out));
  return exit_ok;
}

// A standard stream that the caller closed would be the next file opened, and take what is printed.
void keep_standard_streams() {
  for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(fd, F_GETFD) == -1 && ::open("/dev/null", O_RDONLY) < 0) return;
  }
}

int run_command(int argc, char** argv) {
  CLI::App app{"From garment panel to draped NURBS", "toile"};
  app.set_version_flag("--version", version());
  app.require_subcommand(1);
  Common common;

  DrapeArguments drape_arguments;
  CLI::App* drape_command = app.add_subcommand("drape", "Drape a scene, or a panel file held by --pin");
  drape_command->add_option("SCENE", drape_arguments.input, "scene.toml or panel.igs")->required();
  drape_command->add_option("-o,--output", drape_arguments.directory,
                            "Directory of the results (default: out/<scene name>)");
  drape_command->add_option("--set", drape_arguments.settings, "key.path=value, any TOML value (panel.0.grain_deg=45)")
      ->take_all()
      ->allow_extra_args(false);
  drape_command->add_option("--until", drape_arguments.until, "Simulated time, s or with a unit");
  auto* dry = drape_command->add_flag("--dry-run", drape_arguments.dry, "Say step, time and memory; run nothing");
  drape_command
      ->add_option("--resume", drape_arguments.resume, "Go on from a checkpoint of the same scene (DIR/checkpoint)")
      ->excludes(dry);
  drape_command->add_option("--time-limit", drape_arguments.time_limit,
                            "Wall time after which the run stops and leaves a checkpoint, s or with a unit");
  drape_command->add_option("--pin", drape_arguments.pins, "Panel files: what is held, such as curve:0,2; may repeat")
      ->take_all()
      ->allow_extra_args(false);
  drape_command->add_option("--degree", drape_arguments.degree, "Panel files: degree")->check(CLI::Range(2, 5));
  drape_command->add_option("--span", drape_arguments.span, "Panel files: longest knot span (\"20 mm\")");
  drape_command->add_option("--fabric", drape_arguments.fabric, "Panel files: a preset");

  InspectArguments inspect_arguments;
  CLI::App* inspect_command =
      app.add_subcommand("inspect", "Entities, loops, cells and constraint points of a panel file");
  inspect_command->add_option("FILE", inspect_arguments.input)->required();
  inspect_command->add_option("--svg", inspect_arguments.svg, "Draw the panels");
  inspect_command->add_option("--png", inspect_arguments.png, "Draw them as a picture");
  inspect_command->add_option("--html", inspect_arguments.html, "Draw them on a page with tables and warnings");
  add_refinement(*inspect_command, inspect_arguments);

  InspectArguments convert_arguments;
  std::string convert_target;
  CLI::App* convert_command =
      app.add_subcommand("convert", "Panels to IGES, SVG (1:1), OBJ, PLY, STL, GLB or VTU, by the ending of OUT");
  convert_command->add_option("IN", convert_arguments.input, "IGES, pattern JSON or DXF")->required();
  convert_command->add_option("OUT", convert_target)->required();
  add_refinement(*convert_command, convert_arguments);

  std::string roundtrip_input;
  bool rewrite = false;
  CLI::App* roundtrip_command = app.add_subcommand("roundtrip", "Read, write, read: is everything kept?");
  roundtrip_command->add_option("FILE", roundtrip_input)->required();
  roundtrip_command->add_flag("--rewrite", rewrite, "Make every known record anew instead of replaying it");

  DrapeArguments check_arguments;
  CLI::App* check_command = app.add_subcommand("check", "Validate a scene with its panels, without running");
  check_command->add_option("SCENE", check_arguments.input)->required();
  check_command->add_option("--set", check_arguments.settings, "key.path=value")->take_all()->allow_extra_args(false);

  std::string study_input, study_directory;
  CLI::App* study_command =
      app.add_subcommand("study", "Run a scene many times: errors against time, stability tables");
  study_command->add_option("STUDY", study_input, "study.toml")->required();
  study_command->add_option("-o,--output", study_directory, "Directory of the results (default: out/<study name>)");

  InitArguments init_arguments;
  CLI::App* init_command = app.add_subcommand("init", "Write a scene to start from; without a name, list them");
  init_command->add_option("TEMPLATE", init_arguments.name);
  init_command->add_option("-o,--output", init_arguments.output,
                           "Folder (default: the template's name); with --pattern the scene (default: scene.toml)");
  auto* pattern =
      init_command->add_option("--pattern", init_arguments.pattern, "A sewing pattern: a scene of its panels");
  init_command->add_option("--body", init_arguments.body, "With --pattern: the mesh that wears it, metres, y upwards")
      ->needs(pattern);

  CLI::App* presets_command = app.add_subcommand("presets", "Fabrics that need no table in the scene");

  for (CLI::App* command : {drape_command, inspect_command, convert_command, roundtrip_command, check_command,
                            study_command, init_command, presets_command}) {
    add_common(*command, common);
  }

  Console console;
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const int code = app.exit(error);
    return code == 0 ? exit_ok : exit_usage;
  }
  console.quiet = common.quiet;
  console.verbose = common.verbose;
  console.progress = !common.no_progress;
  console.detect(common.colour);
  try {
    if (*drape_command) return run_drape(drape_arguments, common, console);
    if (*inspect_command) return run_inspect(inspect_arguments, common, console);
    if (*convert_command) return run_convert(convert_arguments, convert_target, common, console);
    if (*roundtrip_command) return run_roundtrip(roundtrip_input, rewrite, common);
    if (*check_command) {
      if (std::filesystem::path(check_arguments.input).extension() != ".toml")
        throw UsageError("check takes a scene.toml");
      return check_scene(scene_of(check_arguments), common.json, console);
    }
    if (*study_command) return run_study_file(study_input, study_directory, common, console);
    if (*init_command && !init_arguments.pattern.empty()) return run_init_pattern(init_arguments, common, console);
    if (*init_command) return run_init(init_arguments.name, init_arguments.output, common, console);
    if (*presets_command) return run_presets(common);
  } catch (const UsageError& error) {
    console.error(error.what());
    return exit_usage;
  } catch (const InputError& error) {
    console.error(error.what());
    return exit_input;
  } catch (const GeometryError& error) {
    console.error(error.what());
    return exit_geometry;
  } catch (const SolverError& error) {
    console.error(error.what());
    return exit_solver;
  } catch (const OutputError& error) {
    console.error(error.what());
    return exit_output;
  } catch (const std::filesystem::filesystem_error& error) {
    console.error(fmt::format("internal error: {}", error.what()));
    return exit_internal;
  } catch (const std::system_error& error) {
    console.error(fmt::format("standard output: {}", error.code().message()));
    return exit_output;
  } catch (const std::bad_alloc&) {
    console.error("out of memory");
    return exit_internal;
  } catch (const std::exception& error) {
    console.error(fmt::format("internal error: {}", error.what()));
    return exit_internal;
  }
  return exit_internal;
}

}  // namespace

int run_program(int argc, char** argv) {
  keep_standard_streams();
  std::signal(SIGXFSZ, SIG_IGN);  // a write beyond the limit of a file's size fails, and is reported, as on a full disk
  const int code = run_command(argc, argv);
  errno = 0;
  if ((std::fflush(stdout) == 0 && std::ferror(stdout) == 0) || code != exit_ok) return code;
  Console().error(fmt::format("standard output: {}", errno ? std::strerror(errno) : "not everything was written"));
  return exit_output;
}

}  // namespace toile
