#include "host/cli/mpi_ranks.hpp"

#include <cstdlib>

#include "btfield/error.hpp"

#ifdef BTFIELD_MPI
#include <mpi.h>
#endif

namespace btfield::cli {
namespace {

/// What launchers of MPI programs set: Open MPI, MPICH and Intel MPI, PMIx (Slurm), MVAPICH.
bool started_as_rank() {
    for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "PMIX_RANK", "MV2_COMM_WORLD_SIZE"}) {
        if (std::getenv(name) != nullptr) return true;
    }
    return false;
}

#ifdef BTFIELD_MPI

/// Called from one thread only.
class MpiRanks final : public ExperimentRanks {
  public:
    MpiRanks() {
        int provided = 0;
        MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);
        MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
        MPI_Comm_size(MPI_COMM_WORLD, &size_);
    }
    ~MpiRanks() override { MPI_Finalize(); }
    MpiRanks(const MpiRanks&) = delete;
    MpiRanks& operator=(const MpiRanks&) = delete;

    [[nodiscard]] int rank() const override { return rank_; }
    [[nodiscard]] int size() const override { return size_; }
    void send(int rank, const std::string& message) override {
        MPI_Send(message.data(), static_cast<int>(message.size()), MPI_BYTE, rank, 0, MPI_COMM_WORLD);
    }
    [[nodiscard]] std::optional<Message> receive() override {
        int there = 0;
        MPI_Status status;
        MPI_Iprobe(MPI_ANY_SOURCE, 0, MPI_COMM_WORLD, &there, &status);
        if (there == 0) return std::nullopt;
        int bytes = 0;
        MPI_Get_count(&status, MPI_BYTE, &bytes);
        Message message;
        message.rank = status.MPI_SOURCE;
        message.bytes.resize(static_cast<std::size_t>(bytes));
        MPI_Recv(message.bytes.data(), bytes, MPI_BYTE, message.rank, 0, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
        return message;
    }

  private:
    int rank_ = 0, size_ = 1;
};

#endif

}  // namespace

std::unique_ptr<ExperimentRanks> open_ranks() {
    if (!started_as_rank()) return nullptr;
#ifdef BTFIELD_MPI
    return std::make_unique<MpiRanks>();
#else
    throw InputError("run as one rank of several", "this btfield was built without MPI",
                     "install an MPI and build again, or use --shard");
#endif
}

}  // namespace btfield::cli
