// HDF5 in the layout of H5MD: de Buyl, Colberg, Höfling (2014), Comput. Phys. Commun. 185, 1546;
// version 1.1. Beside it XDMF, which tells ParaView where the numbers lie.
#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>

#include "core/base/text.h"
#include "core/output/hdf5.h"
#include "core/output/output.h"
#include "core/output/process.h"
#include "core/output/writer.h"
#include "core/plugin/plugin.h"

namespace {

using sim::hdf5::Handle;
using Size = std::vector<hsize_t>;

// Numbers lie in pieces of about so many bytes, those that never change in larger ones.
constexpr hsize_t kPiece = 16384, kMostRows = 65536;

hid_t type_of(const double*) { return H5T_IEEE_F64LE; }
hid_t type_of(const std::int64_t*) { return H5T_STD_I64LE; }
hid_t type_of(const int*) { return H5T_STD_I32LE; }
hid_t native(const double*) { return H5T_NATIVE_DOUBLE; }
hid_t native(const std::int64_t*) { return H5T_NATIVE_INT64; }
hid_t native(const int*) { return H5T_NATIVE_INT; }

[[noreturn]] void fail(const std::string& file) {
  throw sim::Error(sim::ErrorKind::kIo, {"cannot write", file, sim::hdf5::last_failure(),
                                         "check the folder, its permissions and the space there"});
}

// Creates the objects of one file: every call throws if the library fails. No object has a creation
// time, so that the same run gives the same bytes.
class Maker {
 public:
  explicit Maker(std::string file) : file_(std::move(file)) {}

  Handle made(hid_t id, Handle::Close close) const {
    check(id);
    return {id, close};
  }
  void check(long long status) const {
    if (status < 0) fail(file_);
  }

  Handle group(hid_t in, const std::string& name) const {
    const Handle plain = made(H5Pcreate(H5P_GROUP_CREATE), H5Pclose);
    check(H5Pset_obj_track_times(plain, false));
    return made(H5Gcreate2(in, name.c_str(), H5P_DEFAULT, plain, H5P_DEFAULT), H5Gclose);
  }

  Handle dataset(hid_t in, const char* name, hid_t type, const Size& now, const Size& pieces,
                 bool grows) const {
    Size most = now;
    if (grows) most[0] = H5S_UNLIMITED;
    const Handle space =
        made(H5Screate_simple(static_cast<int>(now.size()), now.data(), most.data()), H5Sclose);
    const Handle how = made(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
    check(H5Pset_obj_track_times(how, false));
    if (!pieces.empty()) check(H5Pset_chunk(how, static_cast<int>(pieces.size()), pieces.data()));
    // Constant data, such as springs, is repetitive and compresses well.
    if (!pieces.empty() && !grows && H5Zfilter_avail(H5Z_FILTER_DEFLATE) > 0) {
      check(H5Pset_shuffle(how));
      check(H5Pset_deflate(how, 1));
    }
    return made(H5Dcreate2(in, name, type, space, H5P_DEFAULT, how, H5P_DEFAULT), H5Dclose);
  }

  // Numbers that stay, rows of so many.
  template <class Number>
  Handle numbers(hid_t in, const char* name, const std::vector<Number>& values,
                 hsize_t columns = 1) const {
    const Number* none = nullptr;
    Size size{values.size() / columns};
    if (columns > 1) size.push_back(columns);
    Size pieces;
    if (values.size() * sizeof(Number) > kPiece) {
      pieces = size;
      pieces[0] = std::min(pieces[0], kMostRows);
    }
    Handle set = dataset(in, name, type_of(none), size, pieces, false);
    check(H5Dwrite(set, native(none), H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()));
    return set;
  }

  template <class Number>
  void attribute(hid_t of, const char* name, const std::vector<Number>& values,
                 bool scalar = false) const {
    const Number* none = nullptr;
    const Handle space = sim::hdf5::space_of(scalar ? Size{} : Size{values.size()});
    const Handle made_one =
        made(H5Acreate2(of, name, type_of(none), space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
    check(H5Awrite(made_one, native(none), values.data()));
  }

  void texts(hid_t of, const char* name, const std::vector<std::string>& values,
             bool scalar = false) const {
    std::size_t longest = 1;
    for (const std::string& value : values) longest = std::max(longest, value.size());
    std::string bytes;
    for (const std::string& value : values) bytes += value + std::string(longest - value.size(), 0);
    const Handle type = sim::hdf5::text_type(longest);
    const Handle space = sim::hdf5::space_of(scalar ? Size{} : Size{values.size()});
    const Handle made_one =
        made(H5Acreate2(of, name, type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
    check(H5Awrite(made_one, type, bytes.data()));
  }
  void text(hid_t of, const char* name, const std::string& value) const {
    texts(of, name, {value}, true);
  }

 private:
  std::string file_;
};

// The numbers of one thing at each moment.
template <class Number>
class Series {
 public:
  Series(const Maker& maker, hid_t group, const char* name, const Size& item)
      : maker_(&maker), size_{0}, one_{1} {
    const Number* none = nullptr;
    hsize_t bytes = sizeof(Number);
    Size pieces{1};
    for (const hsize_t each : item) {
      bytes *= each;
      pieces.push_back(std::min(each, kMostRows));
    }
    pieces[0] = std::clamp<hsize_t>(kPiece / bytes, 1, kPiece / sizeof(Number));
    size_.insert(size_.end(), item.begin(), item.end());
    one_.insert(one_.end(), item.begin(), item.end());
    set_ = maker.dataset(group, name, type_of(none), size_, pieces, true);
  }

  void append(const Number* values) {
    Size start(size_.size(), 0);
    start[0] = size_[0]++;
    maker_->check(H5Dset_extent(set_, size_.data()));
    const Handle where = maker_->made(H5Dget_space(set_), H5Sclose);
    maker_->check(
        H5Sselect_hyperslab(where, H5S_SELECT_SET, start.data(), nullptr, one_.data(), nullptr));
    const Handle memory = sim::hdf5::space_of(one_);
    maker_->check(H5Dwrite(set_, native(values), memory, where, H5P_DEFAULT, values));
  }

  hid_t id() const { return set_; }
  bool close() { return set_.close(); }

 private:
  const Maker* maker_;
  Handle set_;
  Size size_, one_;
};

// One system: its particles, springs and observables.
class System {
 public:
  System(const Maker& maker, hid_t file, const std::string& name, bool world,
         const sim::Model& model)
      : model_(model),
        name_(name),
        ties_("connectivity/" + (world ? name : "springs")),
        springs_(0),
        particles_(maker.group(file, "particles/" + name)),
        position_(maker.group(particles_, "position")),
        step_(maker, position_, "step", {}),
        time_(maker, position_, "time", {}),
        x_(maker, position_, "value", {static_cast<hsize_t>(model.particles), 3}) {
    maker.text(x_.id(), "sim_unit", "m");
    maker.text(time_.id(), "sim_unit", "s");
    const Handle box = maker.group(particles_, "box");
    maker.attribute<int>(box, "dimension", {3}, true);
    maker.texts(box, "boundary", {"none", "none", "none"});
    describe(maker, file);
    if (!model.second_order) return;
    const auto with_times = [&](const Handle& group) {
      maker.check(H5Lcreate_hard(position_, "step", group, "step", H5P_DEFAULT, H5P_DEFAULT));
      maker.check(H5Lcreate_hard(position_, "time", group, "time", H5P_DEFAULT, H5P_DEFAULT));
    };
    const Handle velocity = maker.group(particles_, "velocity");
    with_times(velocity);
    v_.emplace(maker, velocity, "value", Size{static_cast<hsize_t>(model.particles), 3});
    maker.text(v_->id(), "sim_unit", "m s-1");
    const Handle mass = maker.numbers(particles_, "mass", model.mass);
    maker.text(mass, "sim_unit", "kg");
    Handle inner;
    if (world)
      inner = maker.group(file, "observables/" + name);
    else
      inner = maker.made(H5Gopen2(file, "observables", H5P_DEFAULT), H5Gclose);
    for (const char* each : {"kinetic_energy", "potential_energy", "work", "drift"}) {
      const Handle group = maker.group(inner, each);
      with_times(group);
      energies_.emplace_back(maker, group, "value", Size{});
      maker.text(energies_.back().id(), "sim_unit", "J");
    }
  }

  void append(const sim::Frame& frame) {
    step_.append(&frame.step);
    time_.append(&frame.t);
    x_.append(frame.x.data());
    if (!v_) return;
    v_->append(frame.v.data());
    const std::array<double, 4> energies{frame.kinetic, frame.potential, frame.work, frame.drift};
    for (std::size_t i = 0; i < energies.size(); ++i) energies_[i].append(&energies[i]);
  }

  // Up to the first that fails: another call would replace the library's words on it.
  bool close() {
    return step_.close() && time_.close() && x_.close() && (!v_ || v_->close()) &&
           std::ranges::all_of(energies_, &Series<double>::close) && position_.close() &&
           particles_.close();
  }

  // The grid of one moment; arrays are pieces of those in the file.
  std::string xdmf(const std::string& file, std::size_t moment, std::size_t moments,
                   double t) const {
    const std::string n = std::to_string(model_.particles), at = std::to_string(moment);
    const auto item = [&](const std::string& path) {
      return "<DataItem ItemType=\"HyperSlab\" Dimensions=\"" + n + " 3\">\n" +
             "<DataItem Dimensions=\"3 3\" Format=\"XML\">" + at + " 0 0 1 1 1 1 " + n +
             " 3</DataItem>\n<DataItem Dimensions=\"" + std::to_string(moments) + " " + n +
             " 3\" NumberType=\"Float\" Precision=\"8\" Format=\"HDF\">" + file + ":/particles/" +
             name_ + "/" + path + "/value</DataItem>\n</DataItem>\n";
    };
    std::string out = "<Grid Name=\"" + name_ + "\">\n<Time Value=\"" + sim::shortest(t) + "\"/>\n";
    if (springs_ > 0)
      out += "<Topology TopologyType=\"Polyline\" NodesPerElement=\"2\" NumberOfElements=\"" +
             std::to_string(springs_) + "\">\n<DataItem Dimensions=\"" + std::to_string(springs_) +
             " 2\" NumberType=\"Int\" Format=\"HDF\">" + file + ":/" + ties_ +
             "</DataItem>\n</Topology>\n";
    else
      out += "<Topology TopologyType=\"Polyvertex\" NumberOfElements=\"" + n + "\"/>\n";
    out += "<Geometry GeometryType=\"XYZ\">\n" + item("position") + "</Geometry>\n";
    if (v_)
      out += "<Attribute Name=\"velocity\" AttributeType=\"Vector\" Center=\"Node\">\n" +
             item("velocity") + "</Attribute>\n";
    return out + "</Grid>\n";
  }

 private:
  void describe(const Maker& maker, hid_t file) {
    const auto n = static_cast<std::size_t>(model_.particles);
    std::vector<int> id(n), species(n);
    for (std::size_t i = 0; i < n; ++i) id[i] = static_cast<int>(i);
    for (const int i : model_.in_bodies) species[static_cast<std::size_t>(i)] = 2;
    for (const int i : model_.pinned) species[static_cast<std::size_t>(i)] = 1;
    maker.numbers(particles_, "id", id);
    const Handle kinds = maker.numbers(particles_, "species", species);
    maker.texts(kinds, "sim_names", {"free", "pinned", "body"});

    const Handle parameters = maker.group(file, "parameters/sim/" + name_);
    maker.text(parameters, "name", model_.name);
    maker.text(parameters, "integrator", model_.method);
    maker.attribute<double>(parameters, "dt", {model_.h}, true);
    if (!model_.second_order) return;
    maker.attribute<double>(parameters, "gravity",
                            {model_.gravity.x(), model_.gravity.y(), model_.gravity.z()});
    maker.attribute<double>(parameters, "drag", {model_.drag}, true);
    maker.text(parameters, "others", sim::join(model_.others, ", "));
    if (!model_.pinned.empty()) maker.numbers(parameters, "pinned", model_.pinned);
    std::vector<int> ends, family;
    std::vector<double> rest, stiffness;
    std::vector<std::string> families;
    for (const sim::ModelFamily& each : model_.families) {
      if (each.rods) continue;
      for (const auto& [a, b] : each.ends) ends.insert(ends.end(), {a, b});
      rest.insert(rest.end(), each.rest.begin(), each.rest.end());
      stiffness.insert(stiffness.end(), each.stiffness.begin(), each.stiffness.end());
      family.resize(rest.size(), static_cast<int>(families.size()));
      families.push_back(each.name);
    }
    springs_ = rest.size();
    if (springs_ == 0) return;
    const Handle ties = maker.numbers(file, ties_.c_str(), ends, 2);
    hobj_ref_t group;
    maker.check(H5Rcreate(&group, particles_, ".", H5R_OBJECT, -1));
    const Handle space = sim::hdf5::space_of({});
    const Handle reference = maker.made(
        H5Acreate2(ties, "particles_group", H5T_STD_REF_OBJ, space, H5P_DEFAULT, H5P_DEFAULT),
        H5Aclose);
    maker.check(H5Awrite(reference, H5T_STD_REF_OBJ, &group));
    maker.numbers(parameters, "spring_stiffness", stiffness);
    maker.numbers(parameters, "spring_rest", rest);
    const Handle kind = maker.numbers(parameters, "spring_family", family);
    maker.texts(kind, "names", families);
  }

  const sim::Model& model_;
  std::string name_, ties_;
  std::size_t springs_;
  Handle particles_, position_;
  Series<std::int64_t> step_;
  Series<double> time_, x_;
  std::optional<Series<double>> v_;
  std::vector<Series<double>> energies_;
};

// In a file's paths and in XML alike.
std::string plain(std::string name) {
  for (char& c : name)
    if (c == '/' || c == '<' || c == '&' || c == '"' || c == ':' || c == '.') c = '_';
  return name.empty() ? "_" : name;
}

class H5md final : public sim::Writer {
 public:
  explicit H5md(const sim::WriterTask& task)
      : task_(task),
        beside_(task.file),
        xdmf_(std::filesystem::path(task.file).replace_extension(".xmf").string()),
        maker_(task.file) {
    for (const sim::Model& model : task_.models)
      if (model.flat)
        throw sim::Error(sim::ErrorKind::kUsage,
                         {"no particles for H5MD", task.file,
                          "the state of '" + model.name + "' is a list of numbers",
                          "write .csv, .jsonl or .npz"});
    sim::hdf5::be_quiet();
    // It is locked for as long as it has no name, by us.
    const Handle access = maker_.made(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
    maker_.check(H5Pset_file_locking(access, false, true));
    file_ = maker_.made(H5Fcreate(beside_.temporary().c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access),
                        H5Fclose);
    const Handle head = maker_.group(file_, "h5md");
    maker_.attribute<int>(head, "version", {1, 1});
    maker_.text(maker_.group(head, "author"), "name", "not given");
    const Handle creator = maker_.group(head, "creator");
    maker_.text(creator, "name", "sim");
    maker_.text(creator, "version", SIM_VERSION);
    for (const char* name : {"particles", "connectivity", "observables", "parameters"})
      maker_.group(file_, name);
    maker_.group(file_, "parameters/sim");
    for (const sim::Model& model : task_.models)
      systems_.push_back(std::make_unique<System>(
          maker_, file_, task_.world ? plain(model.name) : "all", task_.world, model));
  }

  sim::CostEstimate pace() const override { return sim::CostEstimate::kSteps; }

  void add(const sim::Moment& moment) override {
    for (std::size_t i = 0; i < moment.size(); ++i) systems_[i]->append(moment[i]);
    times_.push_back(moment.front().t);
  }

  void commit() override {
    if (!std::ranges::all_of(systems_, &System::close) || !file_.close()) fail(task_.file);
    write_xdmf();
    beside_.commit();
    xdmf_.commit();
  }

 private:
  void write_xdmf() {
    const std::string file = text_of(std::filesystem::path(task_.file).filename().string());
    xdmf_.buffer() +=
        "<?xml version=\"1.0\"?>\n<Xdmf Version=\"2.0\">\n<Domain>\n"
        "<Grid Name=\"run\" GridType=\"Collection\" CollectionType=\"Temporal\">\n";
    for (std::size_t moment = 0; moment < times_.size(); ++moment, xdmf_.flush_if_full()) {
      const std::string t = sim::shortest(times_[moment]);
      if (task_.world)
        xdmf_.buffer() +=
            "<Grid Name=\"world\" GridType=\"Collection\" CollectionType=\"Spatial\">\n<Time "
            "Value=\"" +
            t + "\"/>\n";
      for (const auto& system : systems_)
        xdmf_.buffer() += system->xdmf(file, moment, times_.size(), times_[moment]);
      if (task_.world) xdmf_.buffer() += "</Grid>\n";
    }
    xdmf_.buffer() += "</Grid>\n</Domain>\n</Xdmf>\n";
  }

  static std::string text_of(const std::string& name) {
    std::string out;
    for (const char c : name)
      out += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '"' ? "&quot;" : std::string(1, c);
    return out;
  }

  sim::WriterTask task_;
  sim::FileBeside beside_;
  sim::Output xdmf_;
  Maker maker_;
  Handle file_;
  std::vector<std::unique_ptr<System>> systems_;
  std::vector<double> times_;
};

}  // namespace

SIM_PLUGIN(Writer, "h5/h5md/hdf5") {
  registrar.add(sim::Plugin<sim::Writer>{
      {.name = "h5",
       .summary =
           "HDF5 in the layout of H5MD, for h5py and MDAnalysis; beside it .xmf for ParaView",
       .formula = "h5py.File(\"run.h5\")[\"particles/all/position/value\"]  # frames, particles, 3",
       .source = "de Buyl, Colberg, Höfling (2014), Comput. Phys. Commun. 185, 1546"},
      [](const sim::Params&, const sim::WriterTask& task) {
        return std::make_unique<H5md>(task);
      }});
}
