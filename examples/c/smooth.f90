! Smooths one tetrahedron, split into four at an off-centre node, on a server at HOST:PORT.
module meshsmooth
  use iso_c_binding
  implicit none

  integer(c_int64_t), parameter :: float64 = 2, tetrahedron = 3, goal_worst = 3

  type, bind(c) :: block_type
    integer(c_int64_t) :: element_type, element_count
    type(c_ptr) :: nodes
  end type

  ! The first members of meshsmooth_mesh: what the size leaves out is null.
  type, bind(c) :: mesh_type
    integer(c_size_t) :: size
    integer(c_int64_t) :: scalar, node_count
    type(c_ptr) :: positions
    integer(c_int64_t) :: block_count
    type(c_ptr) :: blocks
  end type

  ! The first members of meshsmooth_options: what the size leaves out has its default.
  type, bind(c) :: options_type
    integer(c_size_t) :: size
    integer(c_int64_t) :: method, weighting
    real(c_double) :: relaxation, lambda, mu, alpha, beta
    integer(c_int64_t) :: goal
  end type

  ! The first members of meshsmooth_summary.
  type, bind(c) :: summary_type
    integer(c_size_t) :: size
    integer(c_int64_t) :: stop_reason, end_rule, iteration_count, node_count, boundary_node_count
    integer(c_int64_t) :: fixed_node_count, moved_node_count, restored_node_count, element_count
    integer(c_int64_t) :: locked_element_count, inverted_count_before, inverted_count_after
  end type

  interface
    integer(c_int) function options_init(options, size, error) bind(c, name='meshsmooth_options_init')
      import
      type(options_type) :: options
      integer(c_size_t), value :: size
      type(c_ptr) :: error
    end function
    integer(c_int) function client_create(target, credentials, client, error) &
        bind(c, name='meshsmooth_client_create')
      import
      character(kind=c_char) :: target(*)
      type(c_ptr), value :: credentials
      type(c_ptr) :: client, error
    end function
    integer(c_int) function smooth(client, mesh, options, call, result, report, error) &
        bind(c, name='meshsmooth_smooth')
      import
      type(c_ptr), value :: client, call
      type(mesh_type) :: mesh
      type(options_type) :: options
      real(c_double) :: result(3, *)
      type(c_ptr) :: report, error
    end function
    integer(c_int) function report_summary(report, summary, error) bind(c, name='meshsmooth_report_summary')
      import
      type(c_ptr), value :: report
      type(summary_type) :: summary
      type(c_ptr) :: error
    end function
    type(c_ptr) function error_message(error) bind(c, name='meshsmooth_error_message')
      import
      type(c_ptr), value :: error
    end function
    subroutine error_free(error) bind(c, name='meshsmooth_error_free')
      import
      type(c_ptr), value :: error
    end subroutine
    subroutine report_free(report) bind(c, name='meshsmooth_report_free')
      import
      type(c_ptr), value :: report
    end subroutine
    subroutine client_free(client) bind(c, name='meshsmooth_client_free')
      import
      type(c_ptr), value :: client
    end subroutine
    integer(c_size_t) function strlen(text) bind(c)
      import
      type(c_ptr), value :: text
    end function
  end interface

contains

  ! Ends the program with the error's message, unless the status is that of a success.
  subroutine check(status, error)
    integer(c_int), intent(in) :: status
    type(c_ptr), intent(in) :: error
    character(kind=c_char), pointer :: text(:)
    if (status == 0) return
    call c_f_pointer(error_message(error), text, [strlen(error_message(error))])
    print '(*(a))', text
    call error_free(error)
    error stop 1
  end subroutine

end module

program example
  use meshsmooth
  implicit none

  real(c_double), target :: positions(3, 5) = reshape([ &
    0d0, 0d0, 0d0, 1d0, 0d0, 0d0, 0d0, 1d0, 0d0, 0d0, 0d0, 1d0, 0.1d0, 0.1d0, 0.1d0], [3, 5])
  integer(c_int32_t), target :: nodes(4, 4) = reshape([ & ! counted from 0
    4, 1, 2, 3, 0, 4, 2, 3, 0, 1, 4, 3, 0, 1, 2, 4], [4, 4])
  type(block_type), target :: tetrahedra
  type(mesh_type) :: mesh
  type(options_type) :: options
  type(summary_type) :: summary
  type(c_ptr) :: client, report, error
  integer(c_int) :: status
  character(len=256) :: address

  call get_command_argument(1, address)
  tetrahedra = block_type(tetrahedron, 4, c_loc(nodes))
  mesh = mesh_type(c_sizeof(mesh), float64, 5, c_loc(positions), 1, c_loc(tetrahedra))

  status = options_init(options, c_sizeof(options), error)
  call check(status, error)
  options%goal = goal_worst
  status = client_create(trim(address) // c_null_char, c_null_ptr, client, error)
  call check(status, error)
  status = smooth(client, mesh, options, c_null_ptr, positions, report, error)
  call check(status, error)
  summary%size = c_sizeof(summary)
  status = report_summary(report, summary, error)
  call check(status, error)
  print '(a, i0, a, i0)', 'inverted: ', summary%inverted_count_after, ', moved: ', summary%moved_node_count
  print '(a, 3(1x, es24.16e3))', 'node 4:', positions(:, 5)
  call report_free(report)
  call client_free(client)
end program
