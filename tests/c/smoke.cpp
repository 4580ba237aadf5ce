// cutis.h from C++11: the header compiles, names have C linkage, handles fit unique_ptr.
#include <cstdio>
#include <cstring>
#include <memory>
#include <vector>

#include "cutis.h"

struct FreeSim {
    void operator()(CutisSim *sim) const { cutis_sim_free(sim); }
};

int main() {
    char why[256] = "";
    std::unique_ptr<CutisSim, FreeSim> sim(cutis_sim_new_default(why, sizeof why));
    if (!sim) {
        std::printf("smoke: %s\n", why);
        return 1;
    }
    const size_t skin = cutis_port_find(sim.get(), "skin.position");
    std::vector<double> x(cutis_port_len(sim.get(), skin)), y(x.size());
    bool well = cutis_abi() == CUTIS_ABI;
    well = well && cutis_sim_get_f64(sim.get(), skin, x.data(), x.size()) == CUTIS_OK;
    well = well && cutis_sim_initialise(sim.get()) == CUTIS_OK;
    well = well && cutis_sim_step(sim.get(), 0.015625) == CUTIS_OK;
    well = well && cutis_sim_get_f64(sim.get(), skin, y.data(), y.size()) == CUTIS_OK;
    if (well) std::printf("smoke: all is well\n");
    return well ? 0 : 1;
}
