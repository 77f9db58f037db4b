#include "ensemble/ranks.hpp"

#include <mpi.h>

#include <exception>

namespace cohort {

Ranks::Ranks() {
  int provided = 0;
  MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
  MPI_Comm_size(MPI_COMM_WORLD, &size_);
  MPI_Comm host = MPI_COMM_NULL;
  MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, rank_, MPI_INFO_NULL, &host);
  MPI_Comm_rank(host, &local_.index);
  MPI_Comm_size(host, &local_.count);
  MPI_Comm_free(&host);
}

Ranks::~Ranks() {
  MPI_Finalize();
}

void Ranks::agree(const std::function<void()>& stage) const {
  std::exception_ptr failure;
  try {
    stage();
  } catch (...) {
    failure = std::current_exception();
  }
  const int mine = failure ? rank_ : size_;
  int lowest = size_;
  MPI_Allreduce(&mine, &lowest, 1, MPI_INT, MPI_MIN, MPI_COMM_WORLD);
  if (lowest == size_) return;
  if (lowest == rank_) std::rethrow_exception(failure);
  throw ToldByAnotherRank();
}

std::string Ranks::broadcast(std::string text) const {
  unsigned long length = text.size();
  MPI_Bcast(&length, 1, MPI_UNSIGNED_LONG, 0, MPI_COMM_WORLD);
  text.resize(length);
  MPI_Bcast(text.data(), static_cast<int>(length), MPI_CHAR, 0, MPI_COMM_WORLD);
  return text;
}

void Ranks::barrier() const {
  MPI_Barrier(MPI_COMM_WORLD);
}

double Ranks::sum(double value) const {
  double result = 0;
  MPI_Allreduce(&value, &result, 1, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
  return result;
}

double Ranks::largest(double value) const {
  double result = 0;
  MPI_Allreduce(&value, &result, 1, MPI_DOUBLE, MPI_MAX, MPI_COMM_WORLD);
  return result;
}

bool Ranks::all(bool value) const {
  return sum(value ? 0 : 1) == 0;
}

}  // namespace cohort
