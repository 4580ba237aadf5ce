//  Two futures from one moment: save, step one way, go back, step the other way.
//
//                     +--> jaw 1 mm down  --> skin A
//       rest --save---+
//                     +--> jaw 1 mm up    --> skin B        and down again: skin A, bit for bit
//
//  ./install --prefix ~/.local && export PKG_CONFIG_PATH=~/.local/lib/pkgconfig LD_LIBRARY_PATH=~/.local/lib
//  c++ -std=c++11 examples/drive_from_cpp.cpp -o futures $(pkg-config --cflags --libs cutis) && ./futures
//
//  Number to expect: 1.04 mm between skin A and rest, 2.09 mm between A and B, 0 mm between A and A again.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "cutis.h"

namespace {

/// The handle as C++ would have it: frees itself, throws what the library says.
class Sim {
public:
    Sim() {
        std::string why(512, '\0');
        handle_.reset(cutis_sim_new_default(&why[0], why.size()));
        if (!handle_) throw std::runtime_error(why.c_str());
    }
    void initialise() { check(cutis_sim_initialise(get())); }
    void step(double dt) { check(cutis_sim_step(get(), dt)); }
    void set(const char *name, const std::vector<double> &values) {
        check(cutis_sim_set_f64(get(), port(name), values.data(), values.size()));
    }
    std::vector<double> get(const char *name) const {
        std::vector<double> values(cutis_port_len(get(), port(name)));
        check(cutis_sim_get_f64(get(), port(name), values.data(), values.size()));
        return values;
    }
    CutisSim *get() const { return handle_.get(); }

private:
    struct Free {
        void operator()(CutisSim *sim) const { cutis_sim_free(sim); }
    };
    size_t port(const char *name) const { return cutis_port_find(get(), name); }
    void check(CutisStatus status) const {
        if (status == CUTIS_OK) return;
        char message[512];
        cutis_sim_message(get(), message, sizeof message);
        throw std::runtime_error(message);
    }
    std::unique_ptr<CutisSim, Free> handle_;
};

double millimetres_between(const std::vector<double> &a, const std::vector<double> &b) {
    double largest = 0.0;
    for (size_t i = 0; i < a.size(); i += 3) {
        const double x = a[i] - b[i], y = a[i + 1] - b[i + 1], z = a[i + 2] - b[i + 2];
        largest = std::max(largest, std::sqrt(x * x + y * y + z * z));
    }
    return 1e3 * largest;
}

std::vector<double> after(Sim &sim, double jaw) {
    std::vector<double> translation = sim.get("bone.translation");
    translation.back() = jaw;  // the last bone is the jaw, z points up
    sim.set("bone.translation", translation);
    sim.step(0.01);
    return sim.get("skin.position");
}

}  // namespace

int main() {
    Sim sim;
    sim.initialise();
    const std::vector<double> rest = sim.get("skin.position");
    const std::unique_ptr<CutisState, void (*)(CutisState *)> moment(cutis_sim_save(sim.get()), cutis_state_free);
    const std::vector<double> down = after(sim, -1e-3);
    cutis_sim_restore(sim.get(), moment.get());
    const std::vector<double> up = after(sim, 1e-3);
    cutis_sim_restore(sim.get(), moment.get());
    const std::vector<double> again = after(sim, -1e-3);
    const double moved = millimetres_between(down, rest), apart = millimetres_between(down, up);
    std::printf("A from rest %.2f mm, A from B %.2f mm, A from A again %g mm\n", moved, apart, millimetres_between(down, again));
    return down == again && std::fabs(moved - 1.04) < 0.05 && std::fabs(apart - 2.09) < 0.1 ? 0 : 1;
}
