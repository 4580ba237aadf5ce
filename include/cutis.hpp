// cutis for C++17: the C interface of cutis.h with owners, views and exceptions. Header only; link libcutis.
//
//   cutis::Sim sim = cutis::Sim::from_file("scene.toml");
//   sim.initialise();
//   sim.set("bone.rotation", {0.0, 0.0, 0.0, 0.14, 0.0, 0.0});
//   sim.step(0.01);
//   std::vector<double> x = sim.get("skin.position");   // n_skin rows of x, y, z in metres
//
// Failures throw cutis::Error, with the status and the text of the library; the simulation then stands at its last
// accepted step. A Sim may move between threads, but serves one at a time.
#ifndef CUTIS_HPP
#define CUTIS_HPP

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "cutis.h"

namespace cutis {

/// A refused call: what cutis_sim_message says, and the status.
class Error : public std::runtime_error {
  public:
    Error(CutisStatus status, const std::string &message) : std::runtime_error(message), status_(status) {}
    /// One of CUTIS_NULL ... CUTIS_CANCELLED.
    CutisStatus status() const noexcept { return status_; }

  private:
    CutisStatus status_;
};

/// A view of numbers that someone else owns.
template <class T> class View {
  public:
    View(T *data, std::size_t size) : data_(data), size_(size) {}
    /// Of anything that has its numbers in one piece and of this type: std::vector, std::array, std::span.
    template <class Container, class = std::enable_if_t<std::is_convertible_v<decltype(std::declval<Container &>().data()), T *>>>
    View(Container &&c) : data_(c.data()), size_(c.size()) {}
    T *data() const noexcept { return data_; }
    std::size_t size() const noexcept { return size_; }
    T *begin() const noexcept { return data_; }
    T *end() const noexcept { return data_ + size_; }
    T &operator[](std::size_t i) const { return data_[i]; }

  private:
    T *data_;
    std::size_t size_;
};

/// A saved state of one simulation's scene.
class State {
  public:
    explicit State(CutisState *state) : state_(state) {}
    const CutisState *get() const noexcept { return state_.get(); }

  private:
    struct Free {
        void operator()(CutisState *state) const { cutis_state_free(state); }
    };
    std::unique_ptr<CutisState, Free> state_;
};

/// One simulation. Ports are named as in cutis.h; arrays are flattened row by row.
class Sim {
  public:
    /// Of a scene file.
    static Sim from_file(const std::string &path) {
        char why[reason] = "";
        return Sim(cutis_sim_new_from_file(path.c_str(), why, sizeof why), why);
    }
    /// Of the text of a scene; files that it names are relative to `folder`.
    static Sim from_text(const std::string &scene, const std::string &folder = ".") {
        char why[reason] = "";
        return Sim(cutis_sim_new_from_text(scene.c_str(), folder.c_str(), why, sizeof why), why);
    }
    /// Of a baked scene: its text, and the bytes of its mesh `model.cutis`.
    static Sim from_baked(const std::string &scene, const std::vector<unsigned char> &mesh) {
        char why[reason] = "";
        return Sim(cutis_sim_new_from_baked(scene.c_str(), mesh.data(), mesh.size(), why, sizeof why), why);
    }
    /// Of the synthetic head.
    static Sim standard() {
        char why[reason] = "";
        return Sim(cutis_sim_new_default(why, sizeof why), why);
    }

    /// Seeks the equilibrium at the inputs as set; no time passes.
    void initialise() { check(cutis_sim_initialise(sim())); }
    /// Advances by `dt` seconds.
    void step(double dt) { check(cutis_sim_step(sim(), dt)); }
    /// Advances to time `t` (s) in equal steps of at most `dt` seconds.
    void run_until(double t, double dt) { check(cutis_sim_run_until(sim(), t, dt)); }
    /// As new.
    void reset() { check(cutis_sim_reset(sim())); }
    /// Simulation time, s.
    double time() const { return cutis_sim_time(sim()); }
    /// Sets the start time (s), before `initialise`.
    void set_time(double t) { check(cutis_sim_set_time(sim(), t)); }

    /// Index of a port, for loops that cannot spare the search; throws CUTIS_ARGUMENT if there is none.
    std::size_t port(const std::string &name) const {
        const std::size_t k = cutis_port_find(sim(), name.c_str());
        if (k >= cutis_port_count(sim())) throw Error(CUTIS_ARGUMENT, "no port is named `" + name + "`");
        return k;
    }
    /// Names of all ports, by index.
    std::vector<std::string> ports() const {
        std::vector<std::string> names;
        for (std::size_t k = 0; k < cutis_port_count(sim()); ++k)
            names.push_back(text([&](char *b, std::size_t n) { return cutis_port_name(sim(), k, b, n); }));
        return names;
    }
    /// SI unit of a port; empty where there is none.
    std::string unit(std::size_t port) const {
        return text([&](char *b, std::size_t n) { return cutis_port_unit(sim(), port, b, n); });
    }
    /// What a port means.
    std::string description(std::size_t port) const {
        return text([&](char *b, std::size_t n) { return cutis_port_description(sim(), port, b, n); });
    }
    /// Dimensions of a port; empty for a single value.
    std::vector<std::size_t> shape(std::size_t port) const {
        std::vector<std::size_t> dims;
        for (std::size_t d = 0; d < cutis_port_rank(sim(), port); ++d) dims.push_back(cutis_port_dim(sim(), port, d));
        return dims;
    }
    /// Numbers in a port.
    std::size_t size(std::size_t port) const { return cutis_port_len(sim(), port); }
    /// Smallest and largest legal value in a port; infinite where there is no bound.
    std::pair<double, double> range(std::size_t port) const {
        std::pair<double, double> bounds;
        check(cutis_port_range(sim(), port, &bounds.first, &bounds.second));
        return bounds;
    }
    /// Names of the rows of a port (bones, loads, markers); empty where they have none.
    std::vector<std::string> rows(std::size_t port) const {
        std::vector<std::string> names;
        for (std::size_t k = 0; k < cutis_port_dim(sim(), port, 0); ++k) {
            if (cutis_port_row(sim(), port, k, nullptr, 0) == 0) break;
            names.push_back(text([&](char *b, std::size_t n) { return cutis_port_row(sim(), port, k, b, n); }));
        }
        return names;
    }
    /// Row of this name in a port; throws CUTIS_ARGUMENT if there is none.
    std::size_t row(std::size_t port, const std::string &name) const {
        const std::vector<std::string> names = rows(port);
        for (std::size_t k = 0; k < names.size(); ++k)
            if (names[k] == name) return k;
        throw Error(CUTIS_ARGUMENT, "no row is named `" + name + "`");
    }
    /// Number type of a port.
    CutisType type(std::size_t port) const { return cutis_port_type(sim(), port); }
    /// Who writes a port.
    CutisCausality causality(std::size_t port) const { return cutis_port_causality(sim(), port); }

    /// Copies values into an input; they act at the next step.
    void set(std::size_t port, View<const double> values) {
        check(cutis_sim_set_f64(sim(), port, values.data(), values.size()));
    }
    /// Sets an Int32 parameter, for example `solver.mostSolves`.
    void set_int(const std::string &name, std::int32_t value) {
        check(cutis_sim_set_i32(sim(), port(name), &value, 1));
    }
    void set(const std::string &name, std::initializer_list<double> values) {
        set(port(name), View<const double>(values.begin(), values.size()));
    }
    void set(const std::string &name, const std::vector<double> &values) {
        set(port(name), View<const double>(values.data(), values.size()));
    }
    /// Copies a port into memory of the caller; nothing is allocated.
    void get(std::size_t port, View<double> values) const {
        check(cutis_sim_get_f64(sim(), port, values.data(), values.size()));
    }
    void get(std::size_t port, View<std::int32_t> values) const {
        check(cutis_sim_get_i32(sim(), port, values.data(), values.size()));
    }
    void get(const std::string &name, View<double> values) const { get(port(name), values); }
    void get(const std::string &name, View<std::int32_t> values) const { get(port(name), values); }

    /// Positions of all nodes of the solver's mesh, m: three numbers a node.
    std::vector<double> nodes() const {
        std::vector<double> x(3 * cutis_node_count(sim()));
        check(cutis_sim_nodes(sim(), x.data(), x.size()));
        return x;
    }
    /// Puts the nodes that no bone holds there; the next step seeks the equilibrium from these positions.
    void start_from(View<const double> x) { check(cutis_sim_start_from(sim(), x.data(), x.size())); }
    /// Ends a step that is under way on another thread; it throws CUTIS_CANCELLED there.
    void cancel() noexcept { cutis_sim_cancel(sim()); }
    /// Bytes of matrices, factor and solver.
    std::size_t memory() const { return cutis_sim_memory(sim()); }

    /// Change of the ports `unknowns` with the ports `knowns` along `seed`, at the last accepted equilibrium.
    std::vector<double> directional_derivative(const std::vector<std::size_t> &unknowns,
                                               const std::vector<std::size_t> &knowns,
                                               const std::vector<double> &seed) {
        std::vector<double> out(total(unknowns));
        check(cutis_sim_directional_derivative(sim(), unknowns.data(), unknowns.size(), knowns.data(), knowns.size(),
                                               seed.data(), seed.size(), out.data(), out.size()));
        return out;
    }
    /// Gradient of `seed . unknowns` by the ports `knowns`: one solve, however many they are.
    std::vector<double> adjoint_derivative(const std::vector<std::size_t> &unknowns,
                                           const std::vector<std::size_t> &knowns, const std::vector<double> &seed) {
        std::vector<double> out(total(knowns));
        check(cutis_sim_adjoint_derivative(sim(), unknowns.data(), unknowns.size(), knowns.data(), knowns.size(),
                                           seed.data(), seed.size(), out.data(), out.size()));
        return out;
    }
    /// A copy of a Float64 port.
    std::vector<double> get(const std::string &name) const {
        const std::size_t k = port(name);
        std::vector<double> values(size(k));
        get(k, View<double>(values.data(), values.size()));
        return values;
    }
    /// A copy of an Int32 port, for example `skin.triangles`.
    std::vector<std::int32_t> get_int(const std::string &name) const {
        const std::size_t k = port(name);
        std::vector<std::int32_t> values(size(k));
        get(k, View<std::int32_t>(values.data(), values.size()));
        return values;
    }

    /// One truth value, for example `solver.converged`.
    bool get_bool(const std::string &name) const {
        std::uint8_t value = 0;
        check(cutis_sim_get_bool(sim(), port(name), &value, 1));
        return value != 0;
    }

    /// A snapshot.
    State save() const {
        CutisState *state = cutis_sim_save(sim());
        if (!state) throw Error(CUTIS_NULL, message());
        return State(state);
    }
    /// Returns to a snapshot; what follows repeats its bits.
    void restore(const State &state) { check(cutis_sim_restore(sim(), state.get())); }
    /// A snapshot as bytes for another process.
    std::vector<std::uint8_t> serialize(const State &state) const {
        std::vector<std::uint8_t> bytes(cutis_state_size(sim(), state.get()));
        check(cutis_state_serialize(sim(), state.get(), bytes.data(), bytes.size()));
        return bytes;
    }
    /// A snapshot out of bytes; damaged or foreign ones throw CUTIS_STATE.
    State deserialize(View<const std::uint8_t> bytes) const {
        CutisState *state = nullptr;
        check(cutis_state_deserialize(sim(), bytes.data(), bytes.size(), &state));
        return State(state);
    }

    /// What the last refused call said.
    std::string message() const {
        return text([&](char *b, std::size_t n) { return cutis_sim_message(sim(), b, n); });
    }
    /// What to know about the last step, one line each; empty as a rule.
    std::string warning() const {
        return text([&](char *b, std::size_t n) { return cutis_sim_warning(sim(), b, n); });
    }
    /// Hash of scene and mesh.
    std::string token() const {
        return text([&](char *b, std::size_t n) { return cutis_sim_token(sim(), b, n); });
    }
    /// The handle, for functions of cutis.h.
    CutisSim *handle() noexcept { return sim_.get(); }

  private:
    static constexpr std::size_t reason = 1024;
    struct Free {
        void operator()(CutisSim *sim) const { cutis_sim_free(sim); }
    };
    std::unique_ptr<CutisSim, Free> sim_;

    Sim(CutisSim *sim, const char *why) : sim_(sim) {
        if (!sim) throw Error(CUTIS_ARGUMENT, why);
    }
    CutisSim *sim() const noexcept { return sim_.get(); }
    void check(CutisStatus status) const {
        if (status != CUTIS_OK) throw Error(status, message());
    }
    std::size_t total(const std::vector<std::size_t> &ports) const {
        std::size_t n = 0;
        for (std::size_t port : ports) n += size(port);
        return n;
    }
    /// A text of which the library says the length.
    template <class Read> static std::string text(Read read) {
        std::vector<char> buffer(read(nullptr, 0) + 1, '\0');
        read(buffer.data(), buffer.size());
        return std::string(buffer.data());
    }
};

} // namespace cutis

#endif // CUTIS_HPP
